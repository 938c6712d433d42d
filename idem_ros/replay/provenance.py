"""How a result was made, of what recording and map by their checksums, and where these lie."""

import json
import os.path
import platform
from dataclasses import asdict
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from idem_ros.core.exceptions import IdemError
from idem_ros.maps.tile_index import map_files
from idem_ros.recording.folder import fingerprint_of
from idem_ros.replay.settings import IDEM, as_record

PACKAGES = ('idem_ros', 'numpy', 'scipy', 'numba', 'rosbags', 'mcap')
NO_SETTINGS = ('versions', 'input', 'topics', 'map')
"""What a record holds beside the settings."""
PEERS_PACKAGE = 'small_gicp'


def made_by(settings, topics, input_, map_=None):
    """Return how a result was made, as a record that JSON can hold.

    Args:
        settings: `Settings`.
        topics: `Topics` that were replayed.
        input_: the recording's `fingerprint`.
        map_: likewise, of the map from a file; None: there is none.

    Returns:
        {'versions', 'input', 'topics', 'parameters' and every other of the settings}, and 'map'.
    """
    return {
        'versions': versions(settings.method),
        'input': input_,
        'topics': asdict(topics),
        **({} if map_ is None else {'map': map_}),
        **as_record(settings),
    }


def map_fingerprint(path):
    """Return the `fingerprint` of a map: of its file, or its metadata and tiles; None of ''.

    Raises:
        UnusableMap: there is no such map.
    """
    return fingerprint_of(path, map_files(path)) if path else None


def versions(method=IDEM):
    """Return {package: version} of what a method runs on; None for one that is not installed."""
    packages = PACKAGES if method == IDEM else (*PACKAGES, PEERS_PACKAGE)
    return {'python': platform.python_version(), **{each: _version(each) for each in packages}}


def as_metadata(record):
    """Return a record of `made_by` as MCAP metadata: {key: text}, what is no text as JSON."""
    return {
        key: value if isinstance(value, str) else json.dumps(value, allow_nan=False)
        for key, value in record.items()
    }


@cache  # a capsule a second asks, and every answer is read from a file
def _version(package):
    try:
        return version(package)
    except PackageNotFoundError:
        return None


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
