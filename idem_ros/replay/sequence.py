"""Odometry over one topic of scans: each against the one before, or against the last few."""

from array import array
from collections import deque
from dataclasses import dataclass, field, replace
from time import perf_counter_ns

import numpy as np
from scipy.spatial.transform import Rotation

from idem_ros.core import Cloud, IdemError, warm_up
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.core.metric.voxel_size import with_voxel_size
from idem_ros.files.trajectory_file import Trajectory
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.pairing.pair import Refusal
from idem_ros.recording.messages import CLOUD
from idem_ros.recording.reader import open_recording
from idem_ros.recording.topics import Topics, find_topic
from idem_ros.refinement.refiner import PreparedCloud, Refinement, prepared, q_tot_at
from idem_ros.replay.frames import Frame, Replay, Sequence
from idem_ros.replay.pairs import Progress, silent
from idem_ros.replay.peers import method_of
from idem_ros.replay.recorded_truth import is_relative, truth_topic_of
from idem_ros.replay.selection import Selection
from idem_ros.replay.sequence_errors import errors_of, tie_of
from idem_ros.replay.settings import SCAN
from idem_ros.replay.spool import Spool
from idem_ros.replay.truths import Truths
from idem_ros.terminal.interrupts import held_back

ODOM = 'odom'
SCANS_KEPT = 10  # of a submap


def odometry_each(
    path, settings, *, source_topic=None, truth_topic=None, progress: Progress = silent
):
    """Register each scan of a topic to those before it, in several ways at once.

    True poses may be of each scan in one frame, or in the scan before it. The frame of the first
    scan is `odom`; each `Frame` holds the pose of a later scan in it. The
    guess is the last motion, continued for the time that has passed. Where a registration finds
    no answer (no overlap, a degenerate scene, too few points), the guess is the pose. Of the
    scans no more is kept than the next one needs. Ctrl-C ends it; what was done is returned.

    Args:
        path: a recording, as `open_recording` takes it.
        settings: [`Settings`] with `sequence` 'scan' or 'submap'; the first says which scans are
            registered.
        source_topic: name; None: found by type.
        truth_topic: name; None: the one that ends in ground_truth, if there is one.
        progress: see `replay_each`.

    Returns:
        [`Replay`] of each settings, with its `Sequence`.

    Raises:
        UnreadableRecording, UnreadableTopic, TopicNotFound: there is nothing to register.
        PeersMissing: small_gicp is asked for and not installed.
    """
    with open_recording(path, settings[0].max_chunk) as recording:
        source = find_topic(recording, CLOUD, 'source', source_topic)
        topics = Topics(source, source, None, truth_topic_of(recording, truth_topic))
        names = topics.names
        total = sum(recording.topics[name].count for name in names)
        warm_up()
        lanes = [_Odometry(each) for each in settings]
        is_chained = bool(topics.truth) and is_relative(recording, topics.truth, source)
        pass_ = _Pass(topics, lanes, Selection(settings[0], recording.begin), is_chained)
        interrupted = pass_.run(progress(recording.messages(names), total))
        return pass_.finished(recording, interrupted)


def continued(step, ratio):
    """Return a (4, 4) motion that lasts `ratio` times as long, at the same speeds."""
    motion = np.eye(4)
    rotation = Rotation.from_matrix(step[:3, :3]).as_rotvec()
    motion[:3, :3] = Rotation.from_rotvec(ratio * rotation).as_matrix()
    motion[:3, 3] = ratio * step[:3, 3]
    return motion


@dataclass(frozen=True)
class _Scan:
    """A scan that was read."""

    stamp: int
    log_time: int
    frame: str
    cloud: PreparedCloud
    read_ms: float


class _Odometry:
    """One way to register the scans: where the last one is, and what the next one is held to."""

    def __init__(self, settings):
        self.settings = settings
        self.method = method_of(settings)
        self.results = Spool()
        self._T_odom_last = np.eye(4)
        self._step = np.eye(4)  # from the scan before the last one to the last one
        self._stamps = deque(maxlen=2)
        self._map = deque(maxlen=1 if settings.sequence == SCAN else SCANS_KEPT)

    def outcome(self, scan):
        """Register a scan; return (its pose in odom, `Refinement`), for the first (I, None)."""
        if not self._map:
            return np.eye(4), None
        start = perf_counter_ns()
        T_guess = self._T_odom_last @ self._continued(scan.stamp)
        target, T_odom_target = self._target()
        T_target_guess = inverse(T_odom_target) @ T_guess
        clouds, config = (target, scan.cloud.cloud), self.settings.config
        found = self.method.register(*clouds, T_target_guess, config)
        time_ms = (perf_counter_ns() - start) / 1e6 + scan.read_ms
        config = replace(config, voxel_size=found.voxel_size)  # what "auto" was
        result = self.method.judged(found, *clouds, config)
        T = T_odom_target @ result.T_target_source if result.is_usable else T_guess
        return T, Refinement(
            stamp=scan.stamp,
            target_frame=ODOM,
            source_frame=scan.frame,
            T_guess=T_guess,
            result=replace(result, T_target_source=T),
            q_tot_before=q_tot_at(T_target_guess, *clouds, result.radius, config),
            time_ms=time_ms,
            points_target=len(target),
            points_source=len(scan.cloud.preprocessed.points),
            dropped_nonfinite=scan.cloud.read.dropped_nonfinite,
            dropped_zero=scan.cloud.read.dropped_zero,
            cropped=scan.cloud.preprocessed.cropped,
            thinned=scan.cloud.preprocessed.thinned,
        )

    def keep(self, scan, T_odom_scan, refinement):
        """Go on from a scan and its pose."""
        if refinement is not None:
            self._step = inverse(self._T_odom_last) @ T_odom_scan
            self.results.append((scan.log_time, refinement))
        self._T_odom_last = T_odom_scan
        self._stamps.append(scan.stamp)
        self._map.append(self._kept(scan, T_odom_scan))

    def _kept(self, scan, T_odom_scan):
        cloud = scan.cloud.cloud
        if self.settings.sequence == SCAN:
            return cloud
        size = with_voxel_size(self.settings.config, cloud, cloud).voxel_size
        cloud = cloud if size is None else cloud.reduced(size)
        return transform_points(T_odom_scan, cloud.points + cloud.origin)

    def _target(self):
        """Return what the next scan is registered to, and where that is in odom."""
        if self.settings.sequence == SCAN:
            return self._map[0], self._T_odom_last
        return Cloud(np.concatenate(self._map)), np.eye(4)

    def _continued(self, stamp):
        if len(self._stamps) < 2:
            return np.eye(4)
        before, last = self._stamps
        return continued(self._step, (stamp - last) / (last - before))


@dataclass
class _Pass:
    """The state of one pass over the scans."""

    topics: Topics
    lanes: list[_Odometry]
    selection: Selection
    is_chained: bool = False
    """Whether each true pose is in the frame of the scan before."""
    stamps: array = field(default_factory=lambda: array('q'))
    """Of all scans [ns]."""
    truths: Truths = field(default_factory=Truths)
    refused: Spool = field(default_factory=Spool)
    first: tuple | None = None
    """(stamp, frame) of the first scan."""
    last: int | None = None

    def run(self, messages):
        """Take every message; return whether somebody interrupted it."""
        try:
            with held_back() as interrupted:
                for topic, log_time, message in messages:
                    if interrupted():
                        break
                    if topic == self.topics.truth:
                        self.truths.add(message)
                        continue
                    self.stamps.append(stamp_ns(message))
                    if self.selection.takes(log_time):
                        self._register(log_time, message)
                    elif self.selection.is_over(log_time) and self._has_truth():
                        break
                return interrupted()
        except KeyboardInterrupt:
            return True

    def _has_truth(self):
        last = [] if self.last is None else [self.last]
        return not self.topics.truth or self.truths.came_for(last)

    def _register(self, log_time, message):
        stamp = stamp_ns(message)
        try:
            if self.last is not None and stamp <= self.last:
                raise IdemError('its stamp is not later than that of the scan before it')
            scan = self._read(stamp, log_time, message)
            # all of them first: after an interruption each lane has the same scans
            outcomes = [lane.outcome(scan) for lane in self.lanes]
        except IdemError as error:
            self.refused.append(Refusal(stamp, str(error)))
            return
        for lane, outcome in zip(self.lanes, outcomes, strict=True):
            lane.keep(scan, *outcome)
        self.first = self.first or (stamp, scan.frame)
        self.last = stamp

    def _read(self, stamp, log_time, message):
        start = perf_counter_ns()
        cloud = prepared('source', message, self.lanes[0].settings.preprocessing)
        read_ms = (perf_counter_ns() - start) / 1e6
        return _Scan(stamp, log_time, message.header.frame_id, cloud, read_ms)

    def finished(self, recording, interrupted):
        if self.is_chained and self.first:
            self.truths = self.truths.chained(sorted(set(self.stamps)), self.first[1])
        replays = [self._finished(lane, recording, interrupted) for lane in self.lanes]
        said = ['interrupted: what came later in the recording is not in here'] * interrupted
        said += [note] if (note := self.selection.note()) else []
        if self.first and not replays[0].frames:
            said.append('of the scans only one can be used; there is nothing to register it to')
        notes = (*said, *self.truths.notes, *recording.warnings)
        return [replace(each, notes=(*each.notes, *notes)) for each in replays]

    def _finished(self, lane, recording, interrupted):
        stamp, frame = self.first or (0, '')
        estimate = self._trajectory(lane)
        T_odom_map = tie_of(self.truths, estimate, frame)
        errors, note = errors_of(self.truths.trajectory(frame), estimate)
        return Replay(
            path=str(recording.path),
            topics=self.topics,
            frames=Spool(self._frame(*result, T_odom_map) for result in lane.results),
            refused=self.refused,
            dropped=0,
            unpaired=0,
            unpaired_for='',
            notes=(note,) if note and self.topics.truth else (),
            method=lane.settings.method,
            interrupted=interrupted,
            lost=dict(recording.lost),
            sequence=Sequence(lane.settings.sequence, stamp, errors),
        )

    def _trajectory(self, lane):
        count = len(lane.results) + bool(self.first)
        poses, stamps = np.empty((count, 4, 4)), np.empty(count, dtype=np.int64)
        if self.first:
            poses[0], stamps[0] = np.eye(4), self.first[0]
        for i, (_, refinement) in enumerate(lane.results, start=1):
            poses[i], stamps[i] = refinement.result.T_target_source, refinement.stamp
        return Trajectory(poses, stamps)

    def _frame(self, log_time, refinement, T_odom_map):
        truth = self.truths.at(refinement.stamp, '', self.first[1])
        return Frame(log_time, refinement, None if truth is None else T_odom_map @ truth)
