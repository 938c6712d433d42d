"""A recording and its trajectory, made consistent: from the files to the folder of results."""

import shutil
from dataclasses import asdict, dataclass, field

import numpy as np

from idem_ros.core.exceptions import IdemError
from idem_ros.core.metric.q_tot import fourth_neighbor_distance
from idem_ros.files.trajectory_file import lines_of_file
from idem_ros.recording.reader import open_recording
from idem_ros.replay.provenance import versions
from idem_ros.replay.settings import Settings, as_record
from idem_ros.smoothing import outputs
from idem_ros.smoothing.config import SmoothingConfig
from idem_ros.smoothing.keyframes import KeyframeClouds, read_scans
from idem_ros.smoothing.odometry import Odometry, UnusableTrajectory, read_odometry
from idem_ros.smoothing.smoother import Smoother, between_keyframes

NEAR = 500_000_000  # [ns] from a stamp that is given to a scan


class NothingToJoin(IdemError):
    """A recording of which no two keyframes are left."""


class UnreadableLoops(IdemError):
    """A file of loops that holds something else."""


@dataclass(frozen=True)
class Asked:
    """What is to be made consistent, and how."""

    recording: str
    trajectory: str
    settings: Settings = field(default_factory=Settings)
    """How clouds are read and registered."""
    config: SmoothingConfig = field(default_factory=SmoothingConfig)
    topic: str | None = None
    """Of the scans; None: found by type."""
    loops: str | None = None
    """A file of pairs of stamps; None: there is none."""


def smooth(asked, folder, run, progress=lambda each, total: each):
    """Fill a folder with the results of a recording; return the record of `smooth.json`.

    Args:
        asked: `Asked`.
        folder: `Path`, empty; points wait in it until all is done.
        run: does tasks, see `Smoother`.
        progress: wraps the iteration over `total` messages.

    Raises:
        IdemError: the recording or the trajectory cannot be used; it says why.
    """
    work = folder / 'work'
    work.mkdir()
    clouds = KeyframeClouds(work)
    odometry, pairs = Odometry(read_odometry(asked.trajectory)), _read_loops(asked.loops)
    with open_recording(asked.recording, asked.settings.max_chunk) as recording:
        reading = odometry, clouds, asked.settings, asked.config
        scans = read_scans(recording, *reading, asked.topic, progress)
    _require_two(scans, odometry, asked)
    given = scans.poses[list(scans.keyframes)]
    registration = asked.settings.config
    smoother = Smoother(clouds, given, scans.median_range, asked.config, registration, run)
    found = smoother.smooth(_keyframes_of(pairs, scans, asked.loops))
    outputs.write_trajectory(folder, scans, between_keyframes(scans, found.poses))
    outputs.write_graph(folder, found)
    outputs.write_covariances(folder, scans, found)
    size = found.voxel_size or fourth_neighbor_distance(clouds.read(0))
    mapped = work / 'map', clouds, size, scans.median_range
    scores = _scores(folder, given, found.poses, mapped)
    record = _record(asked, scans, found, given, scores)
    outputs.write_summary(folder, record)
    shutil.rmtree(work)
    return record


def _scores(folder, given, poses, mapped):
    work, clouds, size, scale = mapped
    _, before = outputs.write_map(None, work, clouds, given, size, scale)
    count, after = outputs.write_map(folder, work, clouds, poses, size, scale)
    scores = {
        name: {
            'score': found.score,
            'cells': found.cells,
            'score_of_passes': found.score_met,
            'cells_of_passes': found.cells_met,
            'mean_map_entropy': found.mean_map_entropy,
        }
        for name, found in (('as_given', before), ('smoothed', after))
    }
    return {'points': count, 'voxel_size': size, **scores}


def _record(asked, scans, found, given, scores):
    part, moved = found.part, found.poses[:, :3, 3] - given[:, :3, 3]
    distance = np.linalg.norm(moved, axis=1)
    return {
        'recording': asked.recording,
        'trajectory': asked.trajectory,
        'topic': scans.topic,
        'scans': len(scans.stamps),
        'keyframes': len(scans.keyframes),
        'uncovered': scans.uncovered,
        'refused': scans.refused,
        'parts': int(part.max()) + 1,
        'moved_m': {'mean': float(distance.mean()), 'most': float(distance.max())},
        'map': scores,
        'relations': [_relation_record(each, scans) for each in found.relations],
        'failures': found.failures,
        'contradicted': int(sum(found.contradicted.values())),
        'notes': [*_notes(scans), *_doubts(found, asked), *scans.notes],
        'alone': _alone(part, scans),
        'versions': versions(),
        **as_record(asked.settings),
        'smoothing': asdict(asked.config),
    }


def _relation_record(each, scans):
    return {
        'i': each.i,
        'j': each.j,
        'stamps_ns': [int(scans.stamps[scans.keyframes[k]]) for k in (each.i, each.j)],
        'is_loop': each.is_loop,
        'verdict': each.verdict,
        'overlap': each.overlap,
        'counts': each.counts,
        'reason': each.reason,
    }


def _alone(part, scans):
    """Return the stamps [ns] of keyframes that hang together with no other."""
    sizes = np.bincount(part)
    alone = np.flatnonzero(sizes[part] == 1)
    return [int(scans.stamps[scans.keyframes[k]]) for k in alone]


def _notes(scans):
    if scans.uncovered:
        first = scans.first_uncovered / 1e9
        yield (
            f'{scans.uncovered} scans have no pose in the trajectory and are left out, the first '
            f'at {first:.3f} s'
        )
    if scans.refused:
        yield f'{scans.refused} scans cannot be used: {"; ".join(scans.reasons)}'


def _doubts(found, asked):
    """Yield a line where the trajectory seems to be of something else."""
    contradicted = found.contradicted
    if 2 * sum(contradicted.values()) > len(contradicted):
        yield (
            f'the scans contradict {sum(contradicted.values())} of {len(contradicted)} steps of '
            f'{asked.trajectory}, or do not bear them out: is it of this recording, and of the '
            'frame of its scans? Else odometry_sigma is too small'
        )


def _require_two(scans, odometry, asked):
    if len(scans.keyframes) >= 2:
        return
    total = len(scans.stamps) + scans.uncovered + scans.refused
    said = '; '.join(_notes(scans))
    if not scans.stamps and scans.uncovered:
        first, last = (stamp / 1e9 for stamp in odometry.span)
        raise UnusableTrajectory(
            f'{asked.trajectory} reaches over {first:.3f} .. {last:.3f} s, and of the {total} '
            f'scans of {asked.recording} none lies between two of its poses half a second apart '
            f'or less; the first is at {scans.first_uncovered / 1e9:.3f} s'
        )
    raise NothingToJoin(
        f'{asked.recording}: {len(scans.keyframes)} keyframe in {total} scans, two at least are '
        'joined; a smaller keyframe_distance makes more' + (f' ({said})' if said else '')
    )


def _read_loops(path):
    """Return the pairs of stamps [ns] of a file with two in each line [s]."""
    if path is None:
        return []
    pairs = []
    for number, words in lines_of_file(path, UnreadableLoops, 'list of loops'):
        try:
            a, b = (round(float(word) * 1e9) for word in words)
        except ValueError as error:
            raise UnreadableLoops(
                f'{path}, line {number} is {" ".join(words)[:60]!r}; it must hold two stamps of '
                'scans in seconds'
            ) from error
        pairs.append((a, b))
    return pairs


def _keyframes_of(pairs, scans, path):
    """Return pairs of stamps [ns] as pairs of keyframes, the nearest along the recording."""
    stamps, keyframes = np.array(scans.stamps), np.array(scans.keyframes)
    found = []
    for pair in pairs:
        numbers = []
        for stamp in pair:
            scan = int(np.argmin(np.abs(stamps - stamp)))
            if abs(int(stamps[scan]) - stamp) > NEAR:
                raise UnreadableLoops(
                    f'{path}: no scan with a pose is within half a second of {stamp / 1e9:.3f} s'
                )
            numbers.append(int(np.argmin(np.abs(keyframes - scan))))
        if numbers[0] != numbers[1]:
            found.append((min(numbers), max(numbers)))
    return found
