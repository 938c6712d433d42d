import re
from pathlib import Path

import pytest

from benchmarks.commands.main import main
from benchmarks.documentation import documents, with_blocks
from idem_ros.commands.main import COMMANDS
from idem_ros.core import IdemError

ROOT = Path(__file__).resolve().parent.parent
README = ROOT / 'README.md'
DOCUMENTS = [README, ROOT / 'CONTRIBUTING.md', *sorted((ROOT / 'docs').glob('*.md'))]
MARKED = 'a\n<!-- x: written by `make docs` -->\nold\n<!-- end of x -->\nb\n'


def test_the_documents_say_what_the_code_says(capsys):
    assert main(['docs', '--check', '--readme', str(README)]) == 0, 'run make docs and commit'


@pytest.mark.parametrize('command', COMMANDS)
def test_the_documents_show_every_command(command):
    name = command.__name__.rpartition('.')[2]
    shown = re.compile(rf'^(idem|make) {name}\b|`(idem|make) {name}\b', re.MULTILINE)
    assert any(shown.search(path.read_text()) for path in DOCUMENTS)


def test_the_readme_is_a_page():
    assert len(README.read_bytes()) <= 8000


@pytest.mark.parametrize('path', DOCUMENTS, ids=lambda path: path.name)
def test_no_link_is_dead(path):
    text = path.read_text()
    for link in re.findall(r'\]\(([^)\s]+)\)', text):
        name, _, anchor = link.partition('#')
        if link.startswith('http'):
            continue
        target = path.parent / name if name else path
        assert target.exists(), link
        if anchor:
            headings = re.findall(r'^#+ (.*)$', target.read_text(), re.MULTILINE)
            assert anchor in {
                re.sub(r'[^\w -]', '', h).lower().replace(' ', '-') for h in headings
            }


def test_a_block_is_replaced_and_the_rest_is_kept():
    assert with_blocks(MARKED, {'x': 'new'}) == MARKED.replace('old', 'new')
    assert with_blocks('a\nb\n', {'x': 'new'}) == 'a\nb\n'


def test_a_document_with_half_a_mark_is_refused():
    with pytest.raises(IdemError, match='once each'):
        with_blocks(MARKED.replace('end of x', 'end'), {'x': 'new'})


@pytest.fixture
def checkout(tmp_path):
    (tmp_path / 'docs').mkdir()
    (tmp_path / 'config').mkdir()
    for path in [*DOCUMENTS, ROOT / 'config' / 'refine.yaml']:
        (tmp_path / path.relative_to(ROOT)).write_text(path.read_text())
    return tmp_path


def test_a_table_out_of_date_is_named_and_told_by_the_exit_code(checkout, capsys):
    reference = checkout / 'docs' / 'reference.md'
    reference.write_text(reference.read_text().replace('`voxel_size`', '`voxelsize`'))
    assert main(['docs', '--check', '--readme', str(checkout / 'README.md')]) == 1
    assert 'out of date: reference.md' in capsys.readouterr().out


def test_a_block_that_stands_nowhere_or_twice_is_refused(checkout):
    reference = checkout / 'docs' / 'reference.md'
    (checkout / 'docs' / 'again.md').write_text(reference.read_text())
    with pytest.raises(IdemError, match=r'topics stands in again\.md, reference\.md'):
        documents(checkout / 'README.md')
    (checkout / 'docs' / 'again.md').unlink()
    reference.unlink()
    with pytest.raises(IdemError, match='topics stands in no document'):
        documents(checkout / 'README.md')


def test_a_readme_that_is_not_there_is_named(tmp_path, capsys):
    assert main(['docs', '--readme', str(tmp_path / 'NONE.md')]) == 2
    assert 'NONE.md does not exist' in capsys.readouterr().err
