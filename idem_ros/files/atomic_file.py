"""Files and folders that appear complete or not at all: written beside, then renamed."""

import errno
import os
import secrets
import shutil
from contextlib import contextmanager, suppress
from pathlib import Path

from idem_ros.core.exceptions import IdemError
from idem_ros.terminal.interrupts import held_back

MOST_LINKS = 40  # in a row, as Linux has it
LONGEST_SUFFIX = 16


class UnwritableFile(IdemError):
    """An output file that cannot be written where it was asked for."""


def require_writable(path):
    """Refuse early an output that could not be put in place after long work.

    Args:
        path: the file to be written later.

    Raises:
        UnwritableFile: its folder does not exist or takes no new file, its name is too long, or
            it is no regular file.
    """
    path = final_path(path)
    try:
        require_folder_around(path)
        if _stands(path) and not path.is_file():
            raise UnwritableFile(
                f'cannot write {path}: it is not a regular file; give a file name'
            )
        _created(path).unlink()
    except OSError as error:
        raise _unwritable(path, error) from error


def require_folder_around(path):
    """Refuse an output where there is no folder to put it in.

    Args:
        path: of the file or folder to be made.

    Raises:
        UnwritableFile: the folder around it does not exist, or is none.
    """
    around = Path(path).absolute().parent
    if not around.exists():
        raise UnwritableFile(f'cannot write {path}: {around} does not exist; make it first')
    if not around.is_dir():
        raise UnwritableFile(f'cannot write {path}: {around} is no folder; name another')


@contextmanager
def replacing(path):
    """Give a temporary path beside `path`; rename it to `path` when the block succeeds.

    Whatever stood at `path` stays untouched until then, and when the block raises. Nobody can
    guess the temporary name, and what stands there already is never opened.

    Args:
        path: the file to write; a symbolic link is followed.

    Yields:
        A path in the same folder with the same suffix, of an empty file.

    Raises:
        UnwritableFile: `require_writable` refuses it, or writing failed (a full disk).
    """
    require_writable(path)
    path, temporary = final_path(path), None
    try:
        with held_back():
            temporary = _created(path)
        yield temporary
        with held_back():
            temporary.replace(path)
    except OSError as error:
        raise _unwritable(path, error) from error
    finally:
        if temporary is not None:
            with held_back():
                temporary.unlink(missing_ok=True)


def final_path(path):
    """Return where a path leads, as a `Path`: symbolic links are followed.

    Raises:
        UnwritableFile: it leads to an open file, as /dev/stdout does, or over another user's link.
    """
    if '\0' in str(path):
        raise UnwritableFile(f'cannot write {str(path)!r}: it holds a zero byte')
    given, path = path, Path(path)
    with suppress(OSError):  # of a path that is none: whoever uses it says so
        for _ in range(MOST_LINKS):
            path = Path(os.path.realpath(path.parent)) / path.name
            if path.parts[1:2] == ('proc',):
                raise UnwritableFile(f'cannot write {given}: it is no regular file; name one')
            if not path.is_symlink():
                break
            if path.lstat().st_uid not in (os.geteuid(), 0):
                raise UnwritableFile(f'cannot write {given}: {path} is a link of another user')
            path = path.parent / path.readlink()
    return Path(os.path.realpath(path))


def temporary_name(path):
    """Return a `Path` beside another, hidden, of its suffix, that nobody can guess."""
    suffix = path.suffix if len(path.suffix) <= LONGEST_SUFFIX else ''
    return path.with_name(f'.{secrets.token_hex(12)}.part{suffix}')


def _created(path):
    temporary = temporary_name(path)
    flags = os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_WRONLY | os.O_CLOEXEC
    os.close(os.open(temporary, flags, 0o666))
    return temporary


def _stands(path):
    """Return whether something is there, as `Path.exists`, but not of a name that is too long."""
    try:
        path.lstat()
    except FileNotFoundError:
        return False
    return True


def _unwritable(path, error):
    if error.errno in (errno.EACCES, errno.EPERM):
        return UnwritableFile(f'cannot write {path}: no permission in the folder {path.parent}')
    return UnwritableFile(f'cannot write {path}: {error.strerror or error}')


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
        require_folder_around(path)
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
