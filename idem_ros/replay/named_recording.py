"""The recording and the map that a result names: whoever made it chose what is opened here."""

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
    return _found(result, Path(result.bag), 'input', under)


def named_map(result, file, under=None):
    """Return the path of the map of a result, likewise; empty where it is of none.

    Args:
        result: `Result`.
        file: the map as its settings name it; empty: it is of none.
        under: see `named_recording`.

    Raises:
        ForbiddenRecording: it lies elsewhere.
    """
    return file and str(_found(result, Path(file), 'map', under))


def _found(result, named, role, under):
    name = ((result.made_by or {}).get(role) or {}).get('name', named.name)
    beside = Path(result.path).parent / name
    found = beside if not is_there(named) and is_there(beside) else named
    if under is not None and not _resolved(found).is_relative_to(_resolved(under)):
        what = 'the map ' if role == 'map' else ''
        raise ForbiddenRecording(
            f'{result.path} is of {what}{found}, which does not lie in {under}, as '
            '--recordings-under asks for'
        )
    return found


def is_there(path):
    """Return whether a `Path` exists; one that is too long does not."""
    try:
        return path.exists()
    except OSError:
        return False


def _resolved(path):
    return Path(os.path.realpath(path))
