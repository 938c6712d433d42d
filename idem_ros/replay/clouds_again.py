"""The clouds that frames of a result were refined from, found again in its recording."""

from collections import deque
from dataclasses import replace

import numpy as np

from idem_ros.core import IdemError, undistort
from idem_ros.core.geometry.se3 import transform_points
from idem_ros.core.metric.measured_points import usual
from idem_ros.maps.open_map import open_map
from idem_ros.maps.tile_index import map_files
from idem_ros.messages.building import CLOUD
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.pairing.map_target import MapTarget
from idem_ros.pairing.pairing import Pairing
from idem_ros.recording.folder import recording_files
from idem_ros.recording.messages import recorded_cloud, transform_message
from idem_ros.recording.reader import open_recording
from idem_ros.recording.topics import FROM_A_FILE, find_topic, find_topics
from idem_ros.refinement.preprocessing import preprocess
from idem_ros.replay.odometry import SCANS_KEPT
from idem_ros.replay.provenance import named_map, named_recording
from idem_ros.replay.settings import SCAN, Settings, from_record

AROUND = 20.0  # [m] of a map beyond the source


def settings_of(result):
    """Return the `Settings` of a result as far as it says them and this version knows them."""
    try:
        return from_record({'parameters': (result.made_by or {}).get('parameters') or {}})
    except IdemError:
        return Settings()


def clouds_of(result, indices, under=None):
    """Yield (index, target, source) of frames of a result, in the order of its recording.

    The recording is read as far as the last frame that is wanted; what it does not hold is not
    yielded. The source is in its own frame, both as they took part, (N, 3).

    Args:
        result: `Result`, of pairs or of a sequence.
        indices: of its frames.
        under: see `named_recording`.

    Raises:
        IdemError: there is no such recording, it has changed, or does not lie where it must.
    """
    path = named_recording(result, under)
    _require_same_size(path, recording_files(path), result, 'input')
    wanted = {}
    for i in indices:
        wanted.setdefault(result.frames[i]['stamp_ns'], []).append(int(i))
    settings = settings_of(result)
    file = named_map(result, settings.map.target_file, under)
    if file:
        _require_same_size(file, map_files(file), result, 'map')
        settings = replace(settings, map=replace(settings.map, target_file=file))
    clouds_by_stamp, stamps = _scans if _sequence_of(result) else _pairs, frozenset(wanted)
    with open_recording(path) as recording:
        for stamp, target, source in clouds_by_stamp(recording, result, settings, stamps):
            for i in wanted.pop(stamp, ()):
                yield i, target, source
            if not wanted:
                return


def _pairs(recording, result, settings, stamps):
    """Pair as the replay did; the guess that a source started from is in the result."""
    file = settings.map.target_file
    target, source = _topics_of(result)
    topics = find_topics(recording, FROM_A_FILE if file else target, source)
    pairing = Pairing(settings.pairing, map_config=settings.map)
    if file:
        pairing.add_map(open_map(file))
    pairing.add_guess(transform_message(np.eye(4), 0, '', ''))
    found = {frame['stamp_ns']: frame for frame in result.frames}
    is_one = topics.target == topics.source
    add_source = pairing.add_scan if is_one else pairing.add_source
    add = {topics.source: add_source, **({topics.target: pairing.add_target} if not file else {})}
    for topic, _, message in recording.messages(list(add)):
        for pair in add[topic](message):
            if pair.stamp in stamps:
                source = _points(pair.source, settings, moved=found[pair.stamp])
                yield pair.stamp, _target(pair, settings, source, found[pair.stamp]), source


def _scans(recording, result, settings, stamps):
    """Yield each scan with those before it, where the result says that they were."""
    sequence = _sequence_of(result) or {}
    topic = find_topic(recording, CLOUD, 'source', _topics_of(result)[1])
    found = {frame['stamp_ns']: frame for frame in result.frames}
    found[sequence.get('first_stamp')] = {'T_target_source': np.eye(4)}
    kept = deque(maxlen=1 if sequence.get('map') == SCAN else SCANS_KEPT)
    for _, _, message in recording.messages([topic]):
        stamp = stamp_ns(message)
        if stamp not in found:
            continue
        if stamp in stamps and kept:
            target = [_in_odom(each, settings, found[at]) for at, each in kept]
            yield stamp, np.concatenate(target), _points(message, settings, moved=found[stamp])
        kept.append((stamp, message))


def _in_odom(message, settings, found):
    T_odom_scan = np.array(found['T_target_source'])
    return transform_points(T_odom_scan, _points(message, settings, moved=found))


def _points(message, settings, is_target=False, moved=None):
    """Return the points that took part; of a sweep whose motion was undone they are undone again.

    moved: the frame of the result that tells its `twist` and `reference`.
    """
    moved = moved or {}
    twist = moved.get('twist')
    read = read_points(message, settings.point_times if twist else None)
    kept = preprocess(read.points, settings.preprocessing, is_target)
    if not twist or read.times.times is None:
        return kept.points
    times, reference = read.times.times[kept.kept], float(moved.get('reference') or 0.0)
    return undistort(kept.points, times, np.array(twist), reference)


def _target(pair, settings, source, frame):
    """Return the points of a target; of a map those around the source."""
    if not isinstance(pair.target, MapTarget):
        return _points(pair.target, settings, is_target=True)
    placed = transform_points(np.array(frame['T_target_source']), source)
    middle = np.median(placed, axis=0)
    near = usual(placed - middle) + middle
    return pair.target.map.points_within(near.min(axis=0) - AROUND, near.max(axis=0) + AROUND)


def _sequence_of(result):
    sequence = result.record.get('sequence')
    return sequence if isinstance(sequence, dict) else None


def _topics_of(result):
    """Return the topics of target and source as the result names them; None: find them."""
    topics = (result.made_by or {}).get('topics') or {}
    return topics.get('target'), topics.get('source')


def _require_same_size(path, files, result, role):
    """Tell at once that a recording, or a map, has changed; a checksum would take reading all."""
    size = sum(file.stat().st_size for file in files)
    then = ((result.made_by or {}).get(role) or {}).get('size', size)
    if size != then:
        raise IdemError(f'{path} has {size} bytes, and had {then} when it was replayed')


def recorded_clouds(replayed):
    """Yield (topic, log time, message) of what a `Replay` refined, as far as its last frame.

    Sources that were not refined are left out; of a target from a file there is no message.
    """
    target = replayed.topics.target
    topics = [topic for topic in (target, replayed.topics.source) if topic]
    refined = {frame.refinement.stamp for frame in replayed.frames}
    last = max((frame.log_time for frame in replayed.frames), default=0)
    with open_recording(replayed.path) as recording:
        for topic, log_time, message in recording.messages(topics):
            if log_time > last:
                return
            if topic == target or stamp_ns(message) in refined:
                yield topic, log_time, recorded_cloud(message)
