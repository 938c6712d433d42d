"""How a result was made: versions, settings, topics, and the recording by its checksum."""

import json
import platform
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version

from idem_ros.evaluation.settings import IDEM, as_record

PACKAGES = ('idem_ros', 'numpy', 'scipy', 'numba', 'rosbags', 'mcap')
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
    packages = PACKAGES if settings.method == IDEM else (*PACKAGES, PEERS_PACKAGE)
    return {
        'versions': {'python': platform.python_version(), **{p: _version(p) for p in packages}},
        'input': input_,
        'topics': asdict(topics),
        **as_record(settings),
    }


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
