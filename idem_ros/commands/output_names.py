"""Outputs that are refused before long work: names that do not do, and what draws them."""

import sys
from importlib import import_module
from pathlib import Path

from idem_ros.terminal.command_line import UsageError
from idem_ros.terminal.printable import printable

NEVER_WRITTEN = '.bag', '.db3', '.ply', '.pcd', '.las', '.laz', '.e57', '.bin', '.npy'
"""Endings of what users bring; no output is of such a kind."""


def require_outputs(args, outputs, inputs=()):
    """Refuse output files that could not be written after long work, or that would cost a file.

    What stands there already is replaced when the work is done, and `note_replaced` says so;
    but neither a cloud nor a recording that `idem` did not write.

    Args:
        args: the namespace; its `replaced` becomes the files that are there already.
        outputs: [(option, file)]; None or '' where none is asked for.
        inputs: files, and folders, that no output may replace or lie in.

    Raises:
        UsageError: an output is an input, lies in one, is named twice, or is somebody's cloud
            or recording.
        UnwritableFile: nothing can be written there.
    """
    from idem_ros.files.atomic_file import require_writable

    read = {Path(file).resolve(): file for file in inputs if file}
    written, args.replaced = {}, []
    for option, file in outputs:
        if not file:
            continue
        require_writable(file)  # as it is named: /dev/stdout may lead to a file
        path = Path(file).resolve()
        _refuse_inputs(option, file, path, read)
        if path in written:
            raise UsageError(
                f'{written[path]} and {option} {file} are one file; name a file for each'
            )
        if path.is_file() and path.stat().st_size:
            _require_ours(option, file, path)
            args.replaced.append(file)
        written[path] = f'{option} {file}'


def note_replaced(args):
    """Say on stderr which files a command replaced, if it looked by `require_outputs`."""
    for file in getattr(args, 'replaced', ()):
        print(f'note: {printable(file)} was there already and is replaced', file=sys.stderr)


def _require_ours(option, file, path):
    from idem_ros.recording.writer import is_foreign

    if path.suffix.lower() in NEVER_WRITTEN or is_foreign(path):
        raise UsageError(
            f'{option} is {file}, which is there already and was not written by idem; '
            'name another file, or remove that one'
        )


def _refuse_inputs(option, file, path, read):
    if path in read:
        raise UsageError(
            f'{option} is {file}, which would replace the input {read[path]}; name another file'
        )
    for folder in read.keys() & set(path.parents):
        raise UsageError(
            f'{option} is {file}, within the recording {read[folder]}; name a file outside of it'
        )


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
