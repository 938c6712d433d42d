"""The recording that a result names: whoever made the result chose what is opened here."""

import os.path
from pathlib import Path

from idem_ros.core.exceptions import IdemError


class ForbiddenRecording(IdemError):
    """A recording outside of the folder that it must lie in."""


def named_recording(result, under=None):
    """Return the `Path` of a result's recording.

    It is the one named then, if it is there; else the one of its name beside the result, if that
    is; else the one named then, which is not there.

    Args:
        result: `Result`.
        under: a folder that it must lie in, wherever links lead; None: it may lie anywhere.

    Raises:
        ForbiddenRecording: it does not.
    """
    named = Path(result.bag)
    name = ((result.made_by or {}).get('input') or {}).get('name', named.name)
    beside = Path(result.path).parent / name
    found = beside if not is_there(named) and is_there(beside) else named
    if under is not None and not _resolved(found).is_relative_to(_resolved(under)):
        raise ForbiddenRecording(
            f'{result.path} is of {found}, which does not lie in {under}, as --recordings-under '
            'asks for'
        )
    return found


def require_map_under(result, file, under):
    """Refuse a map that a `Result` names outside of a folder, see `named_recording`.

    Args:
        result: `Result`.
        file: the map's path; empty: it is of none.
        under: the folder; None: it may lie anywhere.

    Raises:
        ForbiddenRecording: it lies elsewhere.
    """
    if file and under is not None and not _resolved(file).is_relative_to(_resolved(under)):
        raise ForbiddenRecording(
            f'{result.path} is of the map {file}, which does not lie in {under}, as '
            '--recordings-under asks for'
        )


def is_there(path):
    """Return whether a `Path` exists; one that is too long does not."""
    try:
        return path.exists()
    except OSError:
        return False


def _resolved(path):
    return Path(os.path.realpath(path))
