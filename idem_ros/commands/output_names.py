"""Outputs that are refused before long work: names that say another kind, and what draws them."""

from importlib import import_module

from idem_ros.commands.exit_codes import UsageError


def require_ending(option, name, endings):
    """Refuse a file name whose ending says another kind of file than an option writes.

    Args:
        option: as it is given, --out.
        name: of the file.
        endings: those that do, with their dots.

    Raises:
        UsageError: it ends in none of them.
    """
    if not str(name).lower().endswith(tuple(endings)):
        allowed = ' or '.join(endings)
        raise UsageError(f'{option} is {name}; its name must end in {allowed}')


def require_matplotlib(what, extra='plot'):
    """Refuse to draw where matplotlib is not installed.

    Args:
        what: is drawn, in the plural.
        extra: of the package, that brings it.

    Raises:
        UsageError: it says how to install it.
    """
    _require('matplotlib', 'matplotlib', f'{what} need', extra)


def require_rerun():
    """Refuse to write for rerun where it is not installed.

    Raises:
        UsageError: it says how to install it.
    """
    _require('rerun', 'rerun-sdk', '--rerun needs', 'view')


def _require(module, package, needs, extra):
    try:
        import_module(module)
    except ImportError as error:
        raise UsageError(f'{needs} {package}: pip install ".[{extra}]"') from error
