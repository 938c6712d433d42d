"""Repeat a replay from what its result says of itself, and compare the two bit for bit."""

from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path

import numpy as np

from idem_ros.core.exceptions import IdemError
from idem_ros.replay.provenance import (
    NO_SETTINGS,
    is_there,
    map_fingerprint,
    named_map,
    named_recording,
)
from idem_ros.replay.settings import from_record

COMPARED = ('stamp_ns', 'T_target_source', 'q_tot', 'status')


class NotRepeatable(IdemError):
    """A result that does not say how it was made, or whose recording is another one now."""


@dataclass(frozen=True)
class Agreement:
    """How far two results of the same are the same."""

    agreeing: int
    frames: int
    """In the longer of the two."""
    first: str
    """What differs in the first frame that does; empty where none does."""


def settings_of(result):
    """Return (`Settings`, topics as `replay` takes them) of a `Result`.

    Raises:
        NotRepeatable: it does not say.
        UnknownSettings, InvalidConfig: it was made by a version with other settings.
    """
    made_by = result.made_by
    if made_by is None or not {'parameters', 'versions', 'input', 'topics'} <= made_by.keys():
        raise NotRepeatable(
            f'{result.path} does not say how it was made; a result of this version does'
        )
    settings = {key: value for key, value in made_by.items() if key not in NO_SETTINGS}
    settings = from_record(settings)
    of_pairs = 'target', 'source', 'guess', 'truth', 'imu'
    roles = ('source', 'truth', 'imu') if settings.sequence else of_pairs
    topics = {f'{role}_topic': made_by['topics'].get(role) for role in roles}
    if settings.guess.type == 'tf' and not settings.sequence:
        topics['tf_topic'] = made_by['topics'].get('tf')
    if settings.guess.type == 'initial_pose' and not settings.sequence:
        topics['guess_topic'] = made_by['topics'].get('initial_pose')
    return settings, topics


def recording_of(result, under=None):
    """Return the path of the recording that a `Result` was made of, see `named_recording`.

    Raises:
        NotRepeatable: it is not there.
        ForbiddenRecording: it does not lie in the folder `under`.
    """
    path = named_recording(result, under)
    if not is_there(path):
        raise NotRepeatable(
            f'{result.path} is of {path.name}, which is neither at {path} nor beside it; '
            'name the recording'
        )
    return str(path)


def with_map(settings, result, under=None):
    """Return settings with the map that a `Result` was made with, where it lies now.

    Of a result that does not say what its map was, any is taken.

    Args:
        settings: `Settings` of the result.
        result: `Result`.
        under: see `named_recording`.

    Raises:
        NotRepeatable: it is not there, or another one.
        ForbiddenRecording: it does not lie in the folder `under`.
        UnusableMap: it is none.
    """
    file = named_map(result, settings.map.target_file, under)
    if not file:
        return settings
    if not is_there(Path(file)):
        raise NotRepeatable(
            f'{result.path} is of the map {Path(file).name}, which is neither at {file} nor '
            'beside it'
        )
    require_same(result, 'map', map_fingerprint(file))
    return replace(settings, map=replace(settings.map, target_file=file))


def require_same(result, role, found):
    """Refuse another recording, or map, than the one a `Result` was made of, by its checksum.

    Args:
        result: `Result`.
        role: 'input' or 'map'.
        found: the `fingerprint` of what is there.

    Raises:
        NotRepeatable: it names both checksums.
    """
    then = result.made_by.get(role)
    if then is None or found['sha256'] == then['sha256']:
        return
    what = 'the map ' if role == 'map' else ''
    size = f' ({found["size"]} bytes, then {then["size"]})' if 'size' in then else ''
    raise NotRepeatable(
        f'{what}{found["name"]} is not what {result.path} was made of: its SHA-256 is '
        f'{found["sha256"]}, that of the result is {then["sha256"]}{size}'
    )


def agreement(recorded, repeated):
    """Compare the frames of two results in their order: transform, q_tot and status, every bit.

    Args:
        recorded, repeated: iterables of frames as `summary.json_record` has them.

    Returns:
        `Agreement`
    """
    count, agreeing, first = 0, 0, ''
    for count, (then, now) in enumerate(zip_longest(recorded, repeated), start=1):
        difference = _difference(count - 1, then, now)
        agreeing += not difference
        first = first or difference
    return Agreement(agreeing, count, first)


def _difference(i, then, now):
    """Say what of a frame differs; empty where nothing does."""
    if then is None or now is None:
        only = 'recorded' if then else 'repeated'
        return f'frame {i} (stamp {_seconds(then or now)}) is in the {only} result only'
    # as text: 0.0 == -0.0
    differing = [name for name in COMPARED if repr(then.get(name)) != repr(now[name])]
    if not differing:
        return ''
    what = ', '.join(_change(name, then.get(name), now[name]) for name in differing)
    return f'frame {i} (stamp {_seconds(now)}): {what}'


def _change(name, then, now):
    if name != 'T_target_source':
        return f'{name} was {then!r} and is {now!r}'
    largest = np.abs(np.array(then, dtype=float) - now).max()
    return f'{name} differs by up to {largest:.3g}'


def _seconds(frame):
    seconds, nanoseconds = divmod(frame['stamp_ns'], 10**9)
    return f'{seconds}.{nanoseconds:09d} s'
