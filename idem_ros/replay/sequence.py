"""Odometry over one topic of scans: each against the one before, or against the last few."""

from array import array
from collections import deque
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from idem_ros.core import Cloud, IdemError
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.core.geometry.undistortion import reference_time
from idem_ros.core.metric.voxel_size import with_voxel_size
from idem_ros.files.trajectory_file import Trajectory
from idem_ros.messages.building import CLOUD
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.pairing.pair import Refusal
from idem_ros.recording.topics import Topics, find_topic
from idem_ros.refinement.prepared_cloud import PreparedCloud, Stopwatch, left_out, prepared
from idem_ros.refinement.refiner import registered
from idem_ros.refinement.sweep_motion import UnknownMotion
from idem_ros.refinement.times_said import TimesSaid
from idem_ros.refinement.track import Track, twist_of
from idem_ros.refinement.undoing import undoing_of, undone
from idem_ros.replay.frames import Sequence
from idem_ros.replay.peers import method_of
from idem_ros.replay.recorded_truth import is_relative, truth_topic_of
from idem_ros.replay.sequence_errors import errors_of, tie_of
from idem_ros.replay.settings import SCAN
from idem_ros.replay.spool import Spool

ODOM = 'odom'
SCANS_KEPT = 10  # of a submap


class UselessTopic(IdemError):
    """A topic that is named for a role which what is asked for does not have."""


@dataclass(frozen=True)
class Scan:
    """A scan that was read."""

    stamp: int
    frame: str
    cloud: PreparedCloud
    read_ms: float


class Scans:
    """What a replay of a sequence registers: each scan of a topic to those before it.

    True poses may be of each scan in one frame, or in the scan before it. The frame of the first
    scan is `odom`; each result is the pose of a later scan in it.

    Args:
        recording: an open `Recording`.
        settings: `Settings`, of which it takes how scans are preprocessed.
        source_topic: name; None: found by type.
        truth_topic: name; None: the one that ends in ground_truth, if there is one.
        others: of other roles, which a sequence has not.

    Attributes:
        topics: `Topics`.
        waiting: 0: no scan waits for anything.
        refused: [`Refusal`] of scans that cannot be used.

    Raises:
        TopicNotFound: there is nothing to register.
        UselessTopic: one of the others is named.
    """

    waiting = 0

    def __init__(self, recording, settings, source_topic=None, truth_topic=None, **others):
        for useless in filter(None, others.values()):
            name = useless if isinstance(useless, str) else ', '.join(useless)
            raise UselessTopic(
                f'{name} is named, but a sequence has neither target nor guess: '
                '--source-topic names the scans, --truth-topic the true poses'
            )
        source = find_topic(recording, CLOUD, 'source', source_topic)
        self.topics = Topics(source, source, None, truth_topic_of(recording, truth_topic))
        truth = self.topics.truth
        self._is_chained = bool(truth) and is_relative(recording, truth, source)
        self._of_clouds = settings.preprocessing, settings.point_times
        self._times_said, self._motion = TimesSaid(), settings.config.motion
        self._stamps = array('q')  # of all scans [ns]
        self._first = self._last = None  # (stamp, frame) of the scans that are used
        self._others = 0  # scans that are used, but for the first
        self.refused = Spool()

    @property
    def awaited(self):
        """The stamp of the last scan [ns], in a list."""
        return [] if self._last is None else [self._last]

    def refiner(self, settings):
        """Return what registers a `Scan` by `Settings`, see `Odometry.refine`.

        Raises:
            PeersMissing: small_gicp is asked for and not installed.
        """
        return Odometry(settings).refine

    def leave_out(self, message):
        """Take a scan that is not to be registered; a chain of true poses may lead over it."""
        self._stamps.append(stamp_ns(message))

    def completed_by(self, topic, message):
        """Yield the `Scan` of a message, or refuse it."""
        stamp = stamp_ns(message)
        self._stamps.append(stamp)
        try:
            if self._last is not None and stamp <= self._last:
                raise IdemError('its stamp is not later than that of the scan before it')
            watch = Stopwatch()
            cloud = prepared('source', message, *self._of_clouds)
        except IdemError as error:
            self.refused.append(Refusal(stamp, str(error)))
            return
        self._times_said.news(source=cloud.read.times)
        scan = Scan(stamp, message.header.frame_id, cloud, watch.lap())
        self._others += self._first is not None
        self._first = self._first or (stamp, scan.frame)
        self._last = stamp
        yield scan

    def rest(self):
        """Return the scans that waited for something: none did."""
        return ()

    def in_one_frame(self, truths):
        """Return `Truths` of all scans in one frame, be they of each in the one before."""
        if not (self._is_chained and self._first):
            return truths
        return truths.chained(sorted(set(self._stamps)), self._first[1])

    def judged(self, settings, results, truths):
        """Return (the true pose of a `Refinement`, `Sequence`, notes) of a lane."""
        stamp, frame = self._first or (0, '')
        estimate = self._trajectory(results)
        T_odom_map = tie_of(truths, estimate, frame)
        errors, note = errors_of(truths.trajectory(frame), estimate)

        def truth_of(refinement):
            truth = truths.at(refinement.stamp, '', frame)
            return None if truth is None else refinement.at_reference(T_odom_map @ truth)

        notes = (note,) if note and self.topics.truth else ()
        return truth_of, Sequence(settings.sequence, stamp, errors), notes

    def _trajectory(self, results):
        count = len(results) + bool(self._first)
        poses, stamps = np.empty((count, 4, 4)), np.empty(count, dtype=np.int64)
        if self._first:
            poses[0], stamps[0] = np.eye(4), self._first[0]
        for i, (_, refinement) in enumerate(results, start=1):
            poses[i] = refinement.at_stamp(refinement.result.T_target_source)
            stamps[i] = refinement.stamp
        return Trajectory(poses, stamps)

    def left(self):
        """Return what is in no frame, as `Replay` has it: nothing."""
        return {}

    def notes(self):
        """Yield what a reader should know of the scans."""
        if self._first and not self._others:
            yield 'of the scans only one can be used; there is nothing to register it to'
        yield from self._times_said.notes_for(self._motion)


class Odometry:
    """Registers scans by `Settings`; keeps no more of them than the next one needs.

    The guess is the last motion, continued for the time that has passed. Where a registration
    finds no answer (no overlap, a degenerate scene, too few points), the guess is the pose.
    """

    def __init__(self, settings):
        self.settings = settings
        self.method = method_of(settings)
        self._T_odom_last = np.eye(4)
        self._middles = deque(maxlen=2)  # (instant [ns], pose in odom): of a sweep its middle
        self._first = None  # the first scan, until the second tells how it moved
        self._map = deque(maxlen=1 if settings.sequence == SCAN else SCANS_KEPT)

    def refine(self, scan):
        """Register a `Scan` to those before it.

        Returns:
            `Refinement` of its pose in `odom`; None of the first.
        """
        T_guess = self._guess(scan.stamp)
        undoing = self._undoing(scan.cloud.cloud, T_guess)
        if not self._map:
            self._middles.append((scan.stamp + round(1e9 * undoing.middle), T_guess))
            self._go_on(T_guess, scan.cloud.cloud)
            self._first = scan
            return None
        refinement = self._registered(scan, undoing)
        self._middles.append(self._middle(scan, undoing, refinement))
        is_second = self._first is not None and self.settings.config.motion != 'none'
        if is_second and refinement.result.is_usable:
            undoing = self._from_the_begin(scan)
            refinement = self._registered(scan, undoing)
            self._middles[-1] = self._middle(scan, undoing, refinement)
        self._first = None
        assert refinement.took_part is not None  # as of every one that was just registered
        self._go_on(refinement.result.T_target_source, refinement.took_part.source)
        return refinement

    def _from_the_begin(self, scan):
        """Undo the first scan by the motion to the second; return the `Undoing` of that by it."""
        step, duration = self._step()
        track = Track.of_twist(twist_of(step, duration / 1e9))
        first, config = self._first.cloud.cloud, self.settings.config
        if first.times is not None:
            places = config.motion_reference, 'middle'
            at, middle = (reference_time(first.times, place) for place in places)
            self._middles[0] = self._middles[0][0], track.step(at, middle)
            self._map.clear()
            self._go_on(np.eye(4), undone(first, track, at))
        last, T_last = self._middles[0]
        T_guess = T_last @ track.step(0.0, (scan.stamp - last) / 1e9)
        given = config, lambda *sweep: track, self.method.solves_motion
        return undoing_of(scan.cloud.cloud, T_guess, *given)

    @staticmethod
    def _middle(scan, undoing, refinement):
        middle, T_middle = undoing.to_middle(refinement.result)
        T = refinement.result.T_target_source
        return scan.stamp + round(1e9 * middle), T @ T_middle

    def _undoing(self, cloud, T_guess):
        def find(begin, end):
            if len(self._middles) < 2:
                raise UnknownMotion('of two scans that tell the motion one came')
            step, duration = self._step()
            return Track.of_twist(twist_of(step, duration / 1e9))

        return undoing_of(cloud, T_guess, self.settings.config, find, self.method.solves_motion)

    def _registered(self, scan, undoing):
        watch = Stopwatch()
        target, T_odom_target = self._target()
        T_guess = undoing.T_guess
        refinement = registered(
            self.method,
            target,
            replace(undoing, T_guess=inverse(T_odom_target) @ T_guess),
            stamp=scan.stamp,
            target_frame=ODOM,
            source_frame=scan.frame,
            time_ms=scan.read_ms + watch.lap(),
            points_target=len(target),
            points_source=len(scan.cloud.preprocessed.points),
            **left_out(scan.cloud),
        )
        result = refinement.result
        T = T_odom_target @ result.T_target_source if result.is_usable else T_guess
        return replace(refinement, T_guess=T_guess, result=replace(result, T_target_source=T))

    def _go_on(self, T_odom_scan, cloud):
        self._T_odom_last = T_odom_scan
        self._map.append(self._kept(cloud, T_odom_scan))

    def _kept(self, cloud, T_odom_scan):
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

    def _guess(self, stamp):
        """Return where a scan of a stamp [ns] is, if the last motion goes on."""
        if len(self._middles) < 2:
            return self._T_odom_last
        (last, T_last), (step, duration) = self._middles[-1], self._step()
        return T_last @ continued(step, (stamp - last) / duration)

    def _step(self):
        (before, T_before), (last, T_last) = self._middles
        return inverse(T_before) @ T_last, last - before


def continued(step, ratio):
    """Return a (4, 4) motion that lasts `ratio` times as long, at the same speeds."""
    motion = np.eye(4)
    rotation = Rotation.from_matrix(step[:3, :3]).as_rotvec()
    motion[:3, :3] = Rotation.from_rotvec(ratio * rotation).as_matrix()
    motion[:3, 3] = ratio * step[:3, 3]
    return motion
