"""What readers raise, and what every reader asks of a file first."""

from pathlib import Path

from idem_ros.core.exceptions import IdemError


class UnreadableCloud(IdemError):
    """A file that holds no cloud that can be read."""


def refuse_special(path, error_type):
    """Refuse what is no file on a disk: a pipe or a device may never end.

    Raises:
        error_type: there is something at the path, and it is neither a file nor a folder.
    """
    path = Path(path)
    try:
        special = path.exists() and not (path.is_file() or path.is_dir())
    except (OSError, ValueError) as error:
        raise error_type(f'{path!r} is no path: {error}') from error
    if special:
        raise error_type(f'{path} is a pipe, a socket or a device; it must be a file')
