"""How a result was made: versions, settings, topics, and the recording by its checksum."""

import json
import platform
from dataclasses import asdict
from functools import cache
from importlib.metadata import PackageNotFoundError, version

from idem_ros.maps.tile_index import map_files
from idem_ros.recording.fingerprint import fingerprint_of
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
