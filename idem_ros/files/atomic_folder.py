"""A folder that appears complete or not at all: filled beside, then renamed."""

import shutil
from contextlib import contextmanager

from idem_ros.files.atomic_file import UnwritableFile, final_path, temporary_name
from idem_ros.terminal.interrupts import held_back


def require_free(path):
    """Refuse early a folder that could not be put in place after long work.

    Args:
        path: the folder to be made later; an empty one may stand there.

    Raises:
        UnwritableFile: something is there already, or the folder around it does not exist or
            refuses new files.
    """
    path = final_path(path)
    try:
        if path.exists() and not path.is_dir():
            raise UnwritableFile(f'cannot make the folder {path}: a file of that name is there')
        if path.is_dir() and any(path.iterdir()):
            raise UnwritableFile(
                f'the folder {path} is not empty, and nothing in it is overwritten; name a new one'
            )
        if not path.parent.is_dir():
            raise UnwritableFile(
                f'cannot make the folder {path}: {path.parent} does not exist; make it first'
            )
        trial = temporary_name(path)
        trial.mkdir()
        trial.rmdir()
    except PermissionError as error:
        raise UnwritableFile(
            f'cannot make the folder {path}: no permission in {path.parent}'
        ) from error
    except OSError as error:
        raise UnwritableFile(
            f'cannot make the folder {path}: {error.strerror or error}'
        ) from error


@contextmanager
def filling(path):
    """Give a temporary folder beside `path`; rename it to `path` when the block succeeds.

    Args:
        path: the folder to make; nothing, or an empty folder, may stand there.

    Yields:
        An empty folder; it is removed with all it holds when the block raises.

    Raises:
        UnwritableFile: `require_free` refuses it, or writing failed (a full disk).
    """
    require_free(path)
    path = final_path(path)
    temporary = temporary_name(path)
    try:
        temporary.mkdir()
        yield temporary
        with held_back():
            temporary.replace(path)  # refused if something has come there meanwhile
    except OSError as error:
        raise UnwritableFile(
            f'cannot write the folder {path}: {error.strerror or error}'
        ) from error
    finally:
        with held_back():
            shutil.rmtree(temporary, ignore_errors=True)
