"""Pages that are one file: all they show and run is in it, and nothing else can run there."""

from base64 import b64encode
from hashlib import sha256
from importlib.resources import files

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup

from idem_ros.terminal.printable import printable


def environment():
    """Return the `Environment` of a page: every value is escaped and `printable`.

    Templates are named by their path within the package, as 'viewer/viewer.html.jinja'.
    """
    made = Environment(
        autoescape=True,
        finalize=_without_controls,
        loader=FunctionLoader(text_of),
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    made.filters['link'] = data_link
    return made


def text_of(name):
    """Return the text of a file beside the code, by its path within the package."""
    return files('idem_ros').joinpath(name).read_text(encoding='utf-8')


def policy(scripts):
    """Return the Content-Security-Policy of a page on which these scripts, and no others, run."""
    digests = (b64encode(sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = ' '.join(f"'sha256-{digest}'" for digest in digests)
    return (
        f"default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src {allowed}"
    )


def data_link(content, kind):
    """Return bytes of a kind as an address that a page holds itself."""
    return f'data:{kind};base64,{b64encode(content).decode()}'


def _without_controls(value):
    return value if isinstance(value, Markup) else printable(value)
