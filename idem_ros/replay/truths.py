"""The ground truth of a recording: by stamp, and as a trajectory.

True poses may be of each scan in a map or in the scan before it. They are kept as numbers, not as
messages, which would fill the memory.
"""

from array import array
from bisect import bisect_right
from itertools import islice, zip_longest

import numpy as np

from idem_ros.core import IdemError
from idem_ros.files.trajectory_file import Trajectory
from idem_ros.messages.building import CLOUD
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.pairing.guesses import frames_of
from idem_ros.pairing.pair import frame_contradiction
from idem_ros.pairing.stamped_poses import interpolated
from idem_ros.recording.topics import TRUTHS, TopicNotFound, find_topic, find_truth

TRUTH = 'ground_truth'
CHAINED = 'first_scan'
WIDEST = 100_000_000  # [ns] between poses of a stream that one is told between: 4 mm at 3 m/s^2
MOST_NOTES = 10  # frames may be named anew in every message
BETWEEN = (
    'the truth is a stream of poses: where it has none of the stamp of a source, it is between two'
)


class NoTruth(IdemError):
    """A recording without a true pose that can be believed."""


def truth_topic_of(recording, given=None):
    """Return the topic of true poses: the one given, or that named so; None: there is none.

    Raises:
        TopicNotFound: the one given is not there, or several are named so.
    """
    # any other transform may be a guess, or a calibration
    return find_topic(recording, TRUTHS, TRUTH, given) if given else find_truth(recording)


def is_relative(recording, truth, source):
    """Return whether true poses are of each scan in the one before it, not in one frame.

    So they are where they name the same frame twice, or where they are in the frame of targets
    that are the scans themselves: the same points under the same stamp.

    Args:
        recording: an open `Recording`.
        truth, source: topics of it.
    """
    (_, _, first), *_ = [*islice(recording.messages([truth]), 1), (None, None, None)]
    if first is None:
        return False
    frame, child = (name.lstrip('/') for name in frames_of(first))
    if frame and frame == child:
        return True
    for target, topic in recording.topics.items():
        if topic.msgtype != CLOUD or target == source or topic.count < 2:
            continue
        targets, sources = (
            [message for _, _, message in islice(recording.messages([name]), 2)]
            for name in (target, source)
        )
        is_in_frame = not frame or targets[0].header.frame_id.lstrip('/') == frame
        if is_in_frame and any(_is_same(a, b) for a in targets for b in sources):
            return True
    return False


def read_truth(recording, given=None, source=None):
    """Return (`Trajectory`, [notes]) of the true poses of a recording.

    Args:
        recording: an open `Recording`.
        given: the topic of true poses; None: the one named so.
        source: the topic of the scans that they are of; None: found, where there is one.

    Raises:
        TopicNotFound: a topic that is not there.
        NoTruth: no pose can be believed, or they are of several frames and no scans tell which.
    """
    topic = truth_topic_of(recording, given)
    if topic is None:
        raise NoTruth(
            f'{recording.path} has no topic named {TRUTH}; name that of the true poses with '
            '--truth-topic'
        )
    source = _source(recording, source)
    truths = Truths()
    for _, _, message in recording.messages([topic]):
        truths.add(message)
    frame = _frame(recording, truths, source)
    if source and is_relative(recording, topic, source):
        stamps = sorted({stamp_ns(message) for _, _, message in recording.messages([source])})
        truths = truths.chained(stamps, frame)
    trajectory = truths.trajectory(frame)
    if trajectory is None:
        raise NoTruth(
            '; '.join([f'{recording.path} has no true pose of {frame!r}', *truths.notes])
        )
    return trajectory, truths.notes


def _source(recording, given):
    try:
        return find_topic(recording, CLOUD, 'source', given)
    except TopicNotFound:
        if given:
            raise
        return None


def _frame(recording, truths, source):
    children = truths.child_frames()
    if len(children) == 1:
        return children[0]
    if source is None:
        raise NoTruth(
            f'{recording.path} has true poses of {len(children)} frames '
            f'({", ".join(map(repr, children)) or "none"}), and no scans that tell which is '
            'meant: name these by --source-topic; the places of the sensors of a rig, which '
            'make no trajectory, --out FILE.yaml writes'
        )
    (_, _, scan), *_ = recording.messages([source])
    return scan.header.frame_id


def _is_same(a, b):
    return stamp_ns(a) == stamp_ns(b) and bytes(a.data) == bytes(b.data)


class Truths:
    """The truth of each stamp, which may come before its source or after; 112 bytes of each.

    Attributes:
        notes: why some are not believed, and what of their frames is assumed, each once.
    """

    def __init__(self):
        self.notes = []
        self._stamps, self._kinds = array('q'), array('q')
        self._rows = array('d')  # the first three of each pose
        self._numbers_of = {}  # (frame_id, child_frame_id, why it is no pose) -> its kind
        self._awaited, self._is_sorted = None, True
        self._is_stream = False  # poses of a body in one frame, at stamps of their own
        self._path, self._flaw = [], ''

    def add(self, message):
        """Keep the source in the target frame, of one of `TRUTHS`; of one stamp the last counts.

        A TransformStamped is of the source of its stamp; other poses are of those between, too.
        """
        self._is_stream = not hasattr(message, 'transform')
        if hasattr(message, 'poses'):
            self._add_path(message)
        else:
            self._add(message, *frames_of(message))

    def _add_path(self, message):
        """Keep of a nav_msgs/Path what the one before did not say: it comes again, longer."""
        for before, each in zip_longest(self._path, message.poses):
            if each is not None and each != before:
                self._add(each, each.header.frame_id or message.header.frame_id, '')
        self._path = message.poses

    def _add(self, message, *frames):
        try:
            self._keep(stamp_ns(message), matrix_of(message), *frames, '')
        except IdemError as error:
            self._flaw = self._flaw or f'truth: {error}'  # of the first: they say their numbers
            self._keep(stamp_ns(message), np.zeros((4, 4)), *frames, self._flaw)

    def _keep(self, stamp, pose, *kind):
        self._is_sorted &= not self._stamps or stamp >= self._stamps[-1]
        self._stamps.append(stamp)
        self._kinds.append(self._numbers_of.setdefault(kind, len(self._numbers_of)))
        self._rows.frombytes(pose[:3].tobytes())
        if self._awaited:
            self._awaited.discard(stamp)

    def came_for(self, stamps):
        """Return whether the truths of all these stamps are there, believed or not.

        Asked again and again, it looks for the stamps of the first time only.
        """
        if self._awaited is None:
            self._awaited = set(stamps).difference(self._stamps)
        return not self._awaited

    def at(self, stamp, target_frame, source_frame):
        """Return the (4, 4) truth of a stamp [ns]; None where there is none to be believed.

        Args:
            stamp: of the source.
            target_frame, source_frame: of the clouds; an empty one contradicts nothing.
        """
        places, share = self._around(stamp)
        if not places:
            return None
        *frames, reason = list(self._numbers_of)[self._kinds[places[0]]]
        clouds = target_frame, source_frame
        reason = frame_contradiction('truth', tuple(frames), clouds) or reason
        if note := reason or _assumed(frames, clouds):
            self._note(note)
        if reason:
            return None
        poses = [
            np.vstack([np.reshape(self._rows[12 * i : 12 * i + 12], (3, 4)), np.eye(4)[3]])
            for i in places
        ]
        return poses[0] if len(poses) == 1 else interpolated(*poses, share)

    def chained(self, stamps, source_frame):
        """Return `Truths` in one frame, of those of scans each in the frame of the one before.

        Args:
            stamps: of the scans [ns], increasing; where one has no truth, the chain ends.
            source_frame: of the scans.
        """
        result, pose = Truths(), np.eye(4)
        self._is_stream = False  # a step between two steps is none
        result._note('the truth is of each scan in the frame of the one before it; it is chained')
        for i, stamp in enumerate(stamps):
            step = self.at(stamp, '', source_frame)
            if step is None:
                result._note(
                    f'the truth of the scan at {stamp / 1e9:.9f} s is missing: the chain ends '
                    f'there, {len(stamps) - i} scans are not compared'
                )
                break
            pose = pose @ step
            result._keep(stamp, pose, CHAINED, source_frame, '')
        result.notes += self.notes
        return result

    def child_frames(self):
        """Return the frames that they are of, each once."""
        return list(dict.fromkeys(child for _, child, _ in self._numbers_of))

    def _note(self, note):
        if note not in self.notes and len(self.notes) < MOST_NOTES:
            self.notes.append(note)

    def trajectory(self, source_frame):
        """Return the `Trajectory` of a frame, in the order of time; None where there is none."""
        stamps = np.unique(np.array(self._stamps, dtype=np.int64))
        poses, known = np.empty((len(stamps), 4, 4)), np.zeros(len(stamps), dtype=bool)
        for k, stamp in enumerate(stamps.tolist()):
            pose = self.at(stamp, '', source_frame)
            if pose is not None:
                poses[k], known[k] = pose, True
        return Trajectory(poses[known], stamps[known]) if known.any() else None

    def _around(self, stamp):
        """Return the place of the last truth of a stamp, or those around it and how far between.

        No place where there is none, or where those around are too far apart or of other frames.
        """
        if not self._is_sorted:
            self._sort()
        stamps = self._stamps
        k = bisect_right(stamps, stamp)
        if k and stamps[k - 1] == stamp:
            return [k - 1], 0.0
        if not (self._is_stream and 0 < k < len(stamps)):
            return [], 0.0
        places = [k - 1, bisect_right(stamps, stamps[k]) - 1]
        gap = stamps[k] - stamps[k - 1]
        if gap > WIDEST or self._kinds[places[0]] != self._kinds[places[1]]:
            return [], 0.0
        self._note(BETWEEN)
        return places, (stamp - stamps[k - 1]) / gap

    def _sort(self):
        """Bring them into the order of their stamps; of one stamp the last stays the last."""
        order = np.argsort(self._stamps, kind='stable')
        rows = np.reshape(self._rows, (-1, 12))[order]
        self._stamps = array('q', np.take(self._stamps, order).tobytes())
        self._kinds = array('q', np.take(self._kinds, order).tobytes())
        self._rows = array('d', rows.tobytes())
        self._is_sorted = True


def _assumed(frames, clouds):
    """Say what is taken for granted where a truth or a cloud names no frame; empty: nothing."""
    of_truth = [
        name
        for name, frame in zip(('frame_id', 'child_frame_id'), frames, strict=True)
        if not frame
    ]
    if of_truth:
        of_target = repr(clouds[0]) if clouds[0] else 'one fixed frame'
        return (
            f'the truth has an empty {" and ".join(of_truth)}: it is taken to be the pose of the '
            f'source {clouds[1]!r} in {of_target}'
        )
    return ''
