"""Where the sensors of a rig truly are, by the ground truth of a recording."""

import numpy as np

from idem_ros.calibration.frame_tree import bare
from idem_ros.messages.building import TRANSFORM
from idem_ros.messages.transform_message import matrix_of
from idem_ros.replay.recorded_truth import NoTruth, truth_topic_of


def read_true_places(recording, given=None):
    """Return {frame: (parent, (4, 4) in it)} of true poses, and a line about each that changes.

    Args:
        recording: an open `Recording`.
        given: the topic of true poses; None: the one named so.

    Raises:
        NoTruth: there is none that stays.
        InvalidTransform: one is no pose.
        TopicNotFound: a topic that is not there.
    """
    topic = truth_topic_of(recording, given)
    if topic is None:
        raise NoTruth(f'{recording.path} has no topic of true poses; name it by --truth-topic')
    if (kind := recording.topics[topic].msgtype) != TRANSFORM:
        raise NoTruth(
            f'{topic} of {recording.path} is of type {kind}; places of sensors are {TRANSFORM}'
        )
    places, moving = {}, {}
    for _, _, message in recording.messages([topic]):
        name = bare(message.child_frame_id)
        place = bare(message.header.frame_id), matrix_of(message)
        parent, T = places.setdefault(name, place)
        if parent != place[0] or not np.allclose(T, place[1]):
            moving[name] = f'{name!r} moves, and is left out: an --out of TUM lines receives it'
    places = {name: place for name, place in places.items() if name not in moving}
    if not places:
        said = '; '.join(moving.values()) or 'it holds no pose'
        raise NoTruth(f'{topic} of {recording.path} has no place of a sensor: {said}')
    return places, list(moving.values())
