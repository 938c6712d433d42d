"""Files that appear complete or not at all: written beside, then renamed."""

import os
from contextlib import contextmanager
from pathlib import Path

from idem_ros.core.exceptions import IdemError


class UnwritableFile(IdemError):
    """An output file that cannot be written where it was asked for."""


def require_writable(path):
    """Refuse early an output that could not be put in place after long work.

    Args:
        path: the file to be written later.

    Raises:
        UnwritableFile: its folder does not exist or refuses new files, or it is no regular file.
    """
    path = final_path(path)
    if not path.parent.is_dir():
        raise UnwritableFile(
            f'cannot write {path}: the folder {path.parent} does not exist; make it first'
        )
    if path.exists() and not path.is_file():
        raise UnwritableFile(f'cannot write {path}: it is not a regular file; give a file name')
    if not os.access(path.parent, os.W_OK):
        raise UnwritableFile(f'cannot write {path}: no permission in the folder {path.parent}')


@contextmanager
def replacing(path):
    """Give a temporary path beside `path`; rename it to `path` when the block succeeds.

    Whatever stood at `path` stays untouched until then, and when the block raises.

    Args:
        path: the file to write; a symbolic link is followed.

    Yields:
        A path in the same folder with the same suffix, which the block must create.

    Raises:
        UnwritableFile: `require_writable` refuses it, or writing failed (a full disk).
    """
    require_writable(path)
    path = final_path(path)
    temporary = path.with_name(f'.{path.stem}.{os.getpid()}.part{path.suffix}')
    try:
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise UnwritableFile(f'cannot write {path}: {error.strerror or error}') from error
    finally:
        temporary.unlink(missing_ok=True)


def final_path(path):
    """Return where a path leads, as a `Path`: symbolic links are followed."""
    return Path(os.path.realpath(path))
