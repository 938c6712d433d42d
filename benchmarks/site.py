"""A hook of mkdocs (`make site`): the README is the first page, and links out of docs/ hold."""

import re
from pathlib import Path

from mkdocs.structure.files import File

CHECKOUT = Path(__file__).resolve().parent.parent
LINK = re.compile(r'(?<=\]\()(?!https?:|#)([^)\s#]+)')


def on_files(files, config):
    """Add the README as index.md, and every file of the checkout that a document links to."""
    readme = LINK.sub(_as_seen_from_docs, (CHECKOUT / 'README.md').read_text())
    files.append(File.generated(config, 'index.md', content=readme))
    texts = [readme, *(path.read_text() for path in (CHECKOUT / 'docs').glob('*.md'))]
    for outside in sorted(
        {link for text in texts for link in LINK.findall(text) if '../' in link}
    ):
        name = outside.removeprefix('../')
        content = (CHECKOUT / name).read_bytes()
        files.append(File.generated(config, _within_site(name), content=content))
    return files


def on_page_markdown(markdown, page, config, files):
    """Let links out of docs/ lead to the copies that the site holds."""
    return re.sub(r'(?<=\]\()\.\./([^)\s#]+)', lambda match: _within_site(match[1]), markdown)


def _as_seen_from_docs(match):
    link = match[1]
    return link.removeprefix('docs/') if link.startswith('docs/') else f'../{link}'


def _within_site(name):
    # of files that are no pages, mkdocs copies any but Markdown and those with a leading dot
    return f'files/{name}' + ('.txt' if '.' not in Path(name).name else '')
