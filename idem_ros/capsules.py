"""A capsule: clouds, guess, result, parameters and the last diagnostics of one source, as an MCAP.

It is a recording of one pair, with the result of refining it attached as in those of `idem replay
--out`: whatever takes a recording or a result takes a capsule. The folder that capsules are kept
in is bounded in number and bytes, the oldest goes first.
"""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.exceptions import IdemError
from idem_ros.core.geometry.se3 import transform_points
from idem_ros.files.atomic_file import UnwritableFile
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.map_target import MapConfig, MapTarget
from idem_ros.pairing.pair import Pair, Refusal
from idem_ros.recording.embedded import METADATA, RECORD, UnreadableMcap, read_embedded
from idem_ros.recording.messages import (
    cloud_message,
    diagnostics_message,
    recorded_cloud,
    transform_message,
)
from idem_ros.recording.results import result_messages
from idem_ros.recording.topics import Topics
from idem_ros.recording.writer import write_mcap
from idem_ros.refinement.refiner import Refinement
from idem_ros.replay.frames import Frame, Replay
from idem_ros.replay.provenance import NO_SETTINGS, as_metadata, made_by
from idem_ros.replay.settings import Settings, from_record
from idem_ros.results.result_file import UnreadableResult, read_result, record_text
from idem_ros.results.summary import json_record

NAME, VERSION = 'idem_capsule', '1'
TOPICS = Topics('/target', '/source', '/initial_guess', None)
MOST_BYTES = 2**26  # of a target: of a larger one, a map, what the source may reach is kept
MARGIN = 20.0  # radii around the source
# only what is named so is ever deleted
OURS = re.compile(r'idem_capsule_(\d{20})_\d{3}_[a-z_]+\.mcap')


class LaterCapsule(IdemError):
    """A capsule of a version that this one does not know."""


@dataclass(frozen=True)
class Seen:
    """What a node saw of one source."""

    pair: Pair
    settings: Settings
    refinement: Refinement | None
    """None: it was refused."""
    reason: str = ''
    """Why it was refused."""
    diagnostics: tuple[tuple[Any, ...], ...] = ()
    """The last ones, each as `diagnostics_message` takes it."""


def write_capsule(path, seen):
    """Write what was `Seen` into a new MCAP.

    Raises:
        UnwritableFile: `path` cannot be written.
    """
    replayed = _as_replayed(path.name, seen)
    itself = {'name': path.name, 'sha256': ''}  # no file holds its own checksum
    made = made_by(_settings_again(seen), TOPICS, itself)
    capsule = {'version': VERSION, 'guess_type': seen.settings.guess.type, 'refused': seen.reason}
    with TemporaryFile() as text:
        text.writelines(map(str.encode, record_text(json_record(replayed, made))))
        write_mcap(
            path,
            _messages(seen, replayed),
            metadata={METADATA: as_metadata(made), NAME: capsule},
            attachments={RECORD: ('application/json', text)},
        )


def read_capsule(path):
    """Return (`Settings`, {stamp: (4, 4) guess}) of a capsule; None of any other recording.

    The guesses are to the bit: a quaternion does not hold a matrix so.

    Raises:
        LaterCapsule: it is of a later version.
        UnreadableResult, UnknownSettings, InvalidConfig: what it says of itself is not of a node.
    """
    try:
        embedded = read_embedded(path)
    except UnreadableMcap:
        return None  # no MCAP, or one that is cut off: its messages may be read all the same
    capsule = embedded.metadata.get(NAME)
    if capsule is None or RECORD not in embedded.attachments:
        return None
    if capsule.get('version') != VERSION:
        raise LaterCapsule(
            f'{path} is a capsule of version {capsule.get("version")}; this one reads {VERSION}'
        )
    result = read_result(path)
    made = result.made_by or {}
    if 'parameters' not in made:
        raise UnreadableResult(f'{path} is a capsule that does not say how it was made')
    settings = from_record({key: made[key] for key in made if key not in NO_SETTINGS})
    guesses = {f['stamp_ns']: np.array(f['T_guess']) for f in result.frames if f.get('T_guess')}
    return replace(settings, map=MapConfig()), guesses  # its target is in it, as a cloud


def _settings_again(seen):
    """Return `Settings` with which the capsule gives the same: its guess, and what "auto" was."""
    took_part = seen.refinement and seen.refinement.took_part
    config = took_part.config if took_part else seen.settings.config
    config = replace(config, motion='none')  # the source is kept as it was undone
    return replace(seen.settings, config=config, guess=GuessConfig('transform'), map=MapConfig())


def _as_replayed(name, seen):
    frames, refused = [], []
    if seen.refinement is not None:
        frames.append(Frame(seen.pair.stamp, seen.refinement, None))
    else:
        refused.append(Refusal(seen.pair.stamp, seen.reason))
    return Replay(path=name, topics=TOPICS, frames=frames, refused=refused, notes=())


def _messages(seen, replayed):
    """Yield target, guess and source, what was found, and the diagnostics before."""
    stamp, frames = seen.pair.stamp, _frames_of(seen)
    messages = [(TOPICS.target, _target(seen, frames[0]))]
    if seen.refinement is not None or seen.pair.guess.T_target_source is not None:
        T = seen.pair.guess.T_target_source if seen.refinement is None else seen.refinement.T_guess
        messages.append((TOPICS.guess, transform_message(T, stamp, *frames)))
    messages.append((TOPICS.source, _source(seen, frames[1])))
    for log_time, (topic, message) in enumerate(messages, stamp):
        yield topic, log_time, message
    found = (message for message in result_messages(replayed.frames))
    told = (('/diagnostics', 0, diagnostics_message(*each)) for each in seen.diagnostics)
    for log_time, (topic, _, message) in enumerate((*found, *told), stamp + len(messages)):
        yield topic, log_time, message


def _frames_of(seen):
    if seen.refinement is not None:
        return seen.refinement.target_frame, seen.refinement.source_frame
    guess, pair = seen.pair.guess, seen.pair
    return (
        pair.target.header.frame_id or guess.target_frame,
        pair.source.header.frame_id or guess.source_frame,
    )


def _target(seen, frame):
    """Return the target as it came; of a large one, or a map, what lies around the source."""
    target, refinement = seen.pair.target, seen.refinement
    is_map = isinstance(target, MapTarget)
    if not is_map and (refinement is None or len(target.data) <= MOST_BYTES):
        return recorded_cloud(target)
    stamp = min(seen.pair.stamp, stamp_ns(target))
    return cloud_message(_near(target, refinement), stamp, frame, np.float64)


def _source(seen, frame):
    """Return the source as it came, or with the motion of its sweep undone where it was."""
    if seen.refinement is None or seen.refinement.result.twist is None:
        return recorded_cloud(seen.pair.source)
    source = seen.refinement.took_part.source
    return cloud_message(source.points + source.origin, seen.pair.stamp, frame, np.float64)


def _near(target, refinement) -> NDArray:
    """Return the points of a target that a source may reach; of one that was refused none."""
    if refinement is None or refinement.took_part is None:
        return np.empty((0, 3))
    source, result = refinement.took_part.source, refinement.result
    moved = [
        transform_points(T, source.points + source.origin)
        for T in (refinement.T_guess, result.T_target_source)
    ]
    margin = MARGIN * result.radius
    low = np.min([each.min(axis=0) for each in moved], axis=0) - margin
    high = np.max([each.max(axis=0) for each in moved], axis=0) + margin
    if isinstance(target, MapTarget):
        return target.map.points_within(low, high)
    points = read_points(target).points
    inside = ((points >= low) & (points < high)).all(axis=1)
    return points[inside] if inside.any() else points


def keep(folder, seen, most, most_bytes):
    """Write a capsule into a folder, and delete the oldest capsules beyond the bounds.

    Args:
        folder: it is made where its parent exists.
        seen: `Seen`.
        most: capsules that may be in it.
        most_bytes: that they may have together; the newest stays in any case.

    Returns:
        The `Path` of the capsule.

    Raises:
        UnwritableFile: it cannot be written; what was there is as it was.
    """
    folder = Path(folder)
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise UnwritableFile(f'cannot make the folder {folder}: {error.strerror}') from error
    path = _free_name(folder, seen)
    write_capsule(path, seen)
    _leave(folder, path, most, most_bytes)
    return path


def _free_name(folder, seen):
    said = seen.refinement.result.assessment if seen.refinement else None
    if seen.refinement is None:
        what = 'refused'
    else:
        what = seen.refinement.result.status.value if said is None else said.verdict.value
    stamp = max(seen.pair.stamp, 0)
    names = (f'idem_capsule_{stamp:020d}_{k:03d}_{what}.mcap' for k in range(1000))
    for name in names:
        if not (folder / name).exists():
            return folder / name
    raise UnwritableFile(f'{folder} holds a thousand capsules of the stamp {stamp}')


def _leave(folder, newest, most, most_bytes):
    ours = [path for path in folder.iterdir() if OURS.fullmatch(path.name)]
    known = [(path.stat(), path) for path in ours if path.is_file() and not path.is_symlink()]
    number, size = 1, newest.stat().st_size
    by_age = sorted(known, key=lambda each: (each[0].st_mtime_ns, each[1].name), reverse=True)
    for stat, path in by_age:
        if path == newest:
            continue
        number, size = number + 1, size + stat.st_size
        if number > most or size > most_bytes:
            path.unlink(missing_ok=True)
