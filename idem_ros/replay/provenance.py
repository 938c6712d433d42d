"""How a result was made: versions, settings, topics, and the recording by its checksum."""

import json
import platform
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version

from idem_ros.replay.settings import IDEM, as_record

PACKAGES = ('idem_ros', 'numpy', 'scipy', 'numba', 'rosbags', 'mcap')
NO_SETTINGS = ('versions', 'input', 'topics')
"""What a record holds beside the settings."""
PEERS_PACKAGE = 'small_gicp'


def made_by(settings, topics, input_):
    """Return how a result was made, as a record that JSON can hold.

    Args:
        settings: `Settings`.
        topics: `Topics` that were replayed.
        input_: the recording's `fingerprint`.

    Returns:
        {'versions', 'input', 'topics', 'parameters' and every other of the settings}.
    """
    return {
        'versions': versions(settings.method),
        'input': input_,
        'topics': asdict(topics),
        **as_record(settings),
    }


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


def _version(package):
    try:
        return version(package)
    except PackageNotFoundError:
        return None
