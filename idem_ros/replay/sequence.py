"""A recording as a sequence: each scan of one topic against those before it."""

from array import array

import numpy as np

from idem_ros.core import IdemError
from idem_ros.core.geometry.se3 import inverse
from idem_ros.files.trajectory_file import Trajectory
from idem_ros.messages.building import CLOUD
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.pairing.guess_sources import rates_near
from idem_ros.pairing.pair import Refusal
from idem_ros.pairing.stamped_poses import StampedPoses
from idem_ros.pairing.transform_tree import TransformTree
from idem_ros.pairing.turn_rates import IMU
from idem_ros.recording.topics import Topics, find_topic, static_transforms
from idem_ros.refinement.prepared_cloud import Stopwatch, prepared
from idem_ros.replay.frames import Sequence
from idem_ros.replay.odometry import Odometry, Scan
from idem_ros.replay.spool import Spool
from idem_ros.replay.truths import is_relative, truth_topic_of
from idem_ros.trajectory.comparison_table import compared
from idem_ros.trajectory.errors import IncomparableTrajectories, associate


class UselessTopic(IdemError):
    """A topic that is named for a role which what is asked for does not have."""


class Scans:
    """What a replay of a sequence registers: each scan of a topic to those before it.

    True poses may be of each scan in one frame, or in the scan before it. The frame of the first
    scan is `odom`; each result is the pose of a later scan in it.

    Args:
        recording: an open `Recording`.
        settings: `Settings`, of which it takes how scans are preprocessed.
        source_topic: name; None: found by type.
        truth_topic: name; None: the one that ends in ground_truth, if there is one.
        imu_topic: name of the topic of an IMU, whose frame is that of the scans or one that
            static transforms tell the place of; None: none is taken.
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

    def __init__(
        self, recording, settings, source_topic=None, truth_topic=None, imu_topic=None, **others
    ):
        for useless in filter(None, others.values()):
            name = useless if isinstance(useless, str) else ', '.join(useless)
            raise UselessTopic(
                f'{name} is named, but a sequence has neither target nor guess: '
                '--source-topic names the scans, --truth-topic the true poses, --imu-topic an IMU'
            )
        source = find_topic(recording, CLOUD, 'source', source_topic)
        truth = truth_topic_of(recording, truth_topic)
        imu = find_topic(recording, IMU, 'imu', imu_topic) if imu_topic else None
        static = static_transforms(recording) if imu else ()
        self.topics = Topics(source, source, None, truth, tf_static=static, imu=imu)
        self._rates, self._frames, self._guess = (
            StampedPoses(),
            TransformTree(),
            settings.guess,
        )
        self._is_chained = bool(truth) and is_relative(recording, truth, source)
        self._of_clouds = settings.preprocessing, settings.point_times
        self._times_said, self._motion = None, settings.config.motion
        self._stamps = array('q')  # of all scans [ns]
        self._first = self._last = None  # (stamp, frame) of the scans that are used
        self._unused = ''  # which static transforms, and why
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
        odometry = Odometry(settings)
        self._times_said = self._times_said or odometry.times_said
        return odometry.refine

    def leave_out(self, message):
        """Take a scan that is not to be registered; a chain of true poses may lead over it."""
        self._stamps.append(stamp_ns(message))

    def completed_by(self, topic, message):
        """Yield the `Scan` of a message, or refuse it; keep one of the IMU, or of frames."""
        if topic == self.topics.imu:
            self._rates.add(message)
        elif topic in self.topics.tf_static:
            self._keep_frames(message)
        else:
            yield from self._scan_of(message)

    def _keep_frames(self, message):
        try:
            self._frames.add_static(message)
        except IdemError as error:
            self._unused = f'static transforms were refused and not used: {error}'

    def _scan_of(self, message):
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
        rates = rates_near(message, self._rates, self._frames, self._guess)
        scan = Scan(stamp, message.header.frame_id, cloud, watch.lap(), rates)
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
        if self._unused:
            yield self._unused
        if self._times_said:
            yield from self._times_said.notes_for(self._motion)


def tie_of(truths, estimate, frame):
    """Return T_odom_map, the (4, 4) frame of the truth in that of the poses; None without truth.

    The two are tied where the first pose with a truth is: there the error is none.

    Args:
        truths: `Truths` of the scans in any frame.
        estimate: `Trajectory` of the scans.
        frame: of the scans.
    """
    tie = None
    for pose, stamp in zip(estimate.poses, estimate.stamps.tolist(), strict=True):
        truth = truths.at(stamp, '', frame)  # of every one: why it is not believed is noted
        if tie is None and truth is not None:
            tie = pose @ inverse(truth)
    return tie


def errors_of(reference, estimate):
    """Return (the record of `comparison_table.compared`, why there is none).

    The poses as a whole are moved so that the first that has a true one lies on it; rotation and
    scale of the rest are left as they are.

    Args:
        reference: `Trajectory` of the truth, or None.
        estimate: `Trajectory` of the scans.
    """
    if reference is None or len(estimate) < 2:
        return None, 'no truth is of the frame of the scans' if len(estimate) > 1 else ''
    try:
        truth, matched = associate(reference, estimate)
    except IncomparableTrajectories as error:
        return None, f'the trajectory is not compared with the truth: {error}'
    T_map_odom = truth.poses[0] @ inverse(matched.poses[0])
    moved = Trajectory(T_map_odom @ estimate.poses, estimate.stamps)
    return compared(reference, moved), ''
