"""The truth of a recording as a trajectory, be it of each scan in a map or in the scan before."""

from itertools import islice

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.building import CLOUD
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.pairing.guesses import frames_of
from idem_ros.recording.topics import TRUTHS, TopicNotFound, find_topic, find_truth
from idem_ros.replay.truths import Truths

TRUTH = 'ground_truth'


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
