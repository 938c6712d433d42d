"""Sightings of a rig in a recording, and its true places.

Sightings are some clouds of the reference, and the nearest of others.
"""

from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from idem_ros.calibration.frame_tree import FrameTree, bare
from idem_ros.calibration.initial_extrinsics import tree_of_messages
from idem_ros.calibration.sighting_messages import SECOND, measured_in, nearest
from idem_ros.calibration.synchronized_scans import Sighting
from idem_ros.core.exceptions import IdemError
from idem_ros.messages.building import CLOUD, TRANSFORM
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.pairing.guesses import TF
from idem_ros.recording.topics import STATIC, TopicNotFound, find_topic
from idem_ros.replay.truths import TRUTH, NoTruth, truth_topic_of

ALONE_NS = 500_000_000  # how far apart clouds may be of a reference that has but one


class UnusableRig(IdemError):
    """A recording of which no rig can be calibrated; it says what it lacks."""


@dataclass
class RecordedRig:
    """What a recording holds of a rig."""

    topics: list
    """Of the clouds, the reference's first; without those that are silent."""
    names: list
    """The frames of the sensors."""
    stamps: dict
    """{topic: [ns], increasing}."""
    tree: FrameTree | None
    """Of tf_static; None: there is none."""
    silent: list = ()
    """Topics without a message."""
    flaws: list = field(default_factory=list)
    """What is left out, a line each."""
    truth: dict = field(default_factory=dict)
    """{(frame, child): (4, 4) child in frame} of the recording's ground truth."""

    def truth_of(self):
        """Return {name: (4, 4)} of the sensors that it has in the frame of the reference."""
        pairs = {name: (bare(self.names[0]), bare(name)) for name in self.names[1:]}
        return {name: self.truth[pair] for name, pair in pairs.items() if pair in self.truth}


def cloud_topics(recording, given, reference=None):
    """Return the topics of clouds, the reference's first.

    Args:
        recording: open `Recording`.
        given: names; None: all of PointCloud2.
        reference: one of them; None: the first.

    Raises:
        TopicNotFound: one is not there, is of another type, or is given twice; or there is one.
    """
    every = [name for name, topic in recording.topics.items() if topic.msgtype == CLOUD]
    topics = [find_topic(recording, CLOUD, 'sensor', each) for each in given] if given else every
    twice = [name for name, count in Counter(topics).items() if count > 1]
    if twice:
        raise TopicNotFound(f'{twice[0]} is given for two sensors; each has a topic of its own')
    if len(topics) < 2:
        raise TopicNotFound(
            f'{recording.path} has {len(topics)} topics of PointCloud2 to calibrate '
            f'({", ".join(topics) or "none"}); two at least are needed'
        )
    if reference is None:
        return topics
    first = find_topic(recording, CLOUD, 'reference', reference)
    if first not in topics:
        raise TopicNotFound(f'{first} is none of the sensors: {", ".join(topics)}')
    return [first, *(each for each in topics if each != first)]


def recorded_rig(recording, topics):
    """Return the `RecordedRig`: one pass over the messages, of which none is kept.

    Raises:
        UnusableRig: two sensors have one frame, or the reference is silent.
    """
    static = [n for n, t in recording.topics.items() if t.msgtype == TF and n.endswith(STATIC)]
    stamps, frames, transforms, truth = {topic: [] for topic in topics}, {}, [], {}
    of_truth = [n for n, t in recording.topics.items() if t.msgtype == TRANSFORM and TRUTH in n]
    for topic, _, message in recording.messages([*topics, *static, *of_truth]):
        if topic in stamps:
            stamps[topic].append(stamp_ns(message))
            frames.setdefault(topic, bare(message.header.frame_id))
        elif topic in of_truth:
            pair = bare(message.header.frame_id), bare(message.child_frame_id)
            with suppress(IdemError):  # a truth that is none is beside nothing
                truth[pair] = matrix_of(message)
        else:
            transforms.append(message)
    if not stamps[topics[0]]:
        raise UnusableRig(f'{topics[0]}, the reference, is silent: name another by --reference')
    silent = [topic for topic in topics if not stamps[topic]]
    topics = [topic for topic in topics if stamps[topic]]
    if len(topics) < 2:
        raise UnusableRig(f'but for {topics[0]} all topics are silent: {", ".join(silent)}')
    names = [frames[topic] or bare(topic).replace('/', '_') for topic in topics]
    for name, count in Counter(names).items():
        if count > 1:
            same = ' and '.join(t for t, n in zip(topics, names, strict=True) if n == name)
            raise UnusableRig(f'{same} are both of the frame {name!r}: tell them apart by --names')
    tree, unread = tree_of_messages(' and '.join(static), transforms) if transforms else (None, [])
    stamps = {topic: sorted(set(stamps[topic])) for topic in topics}
    return RecordedRig(topics, names, stamps, tree, silent, unread, truth)


def sightings_in(recording, rig, count, point_times, prepare):
    """Return `Sighting`s at instants spread evenly over a recording; `rig.flaws` grows.

    Args:
        recording: open `Recording`.
        rig: its `RecordedRig`.
        count: how many instants, at most.
        point_times: `PointTimeConfig`.
        prepare: prepare(points, times) returns those that take part.

    Raises:
        UnusableRig: no other sensor has a cloud at an instant of the reference.
    """
    chosen = _chosen(rig, count)
    wanted = {each for row, near in chosen for each in (*row, *near) if each is not None}
    measured = _measured(recording, rig, wanted, point_times, prepare)
    sightings = []
    for row, near in chosen:
        at = row[0][1]
        each = tuple(_at(measured.get(key), key, at) for key in row)
        neighbours = tuple(
            (measured[key], (key[1] - at) / SECOND) for key in near if key in measured
        )
        sightings.append(Sighting(f'{at / SECOND:.3f} s', each, neighbours))
    return sightings


def lateness(rig, sightings):
    """Yield a line about each sensor whose clouds are later than the reference's, or earlier."""
    late = []
    for s in range(len(rig.names)):
        times = [each.measured[s].times for each in sightings if each.measured[s] is not None]
        late.append(float(np.median([t.min() for t in times])) if times else np.nan)
    for name, each in zip(rig.names[1:], late[1:], strict=True):
        if abs(each - late[0]) > 1e-3:
            yield f'{name} measures {1e3 * (each - late[0]):+.1f} ms after {rig.names[0]}'


def _chosen(rig, count):
    """Return [([(topic, stamp) or None of each sensor], [neighbours of the reference])]."""
    reference, *others = (rig.stamps[topic] for topic in rig.topics)
    period = float(np.median(np.diff(reference))) if len(reference) > 1 else ALONE_NS
    last = len(reference) - 1
    # all but the last are followed by a cloud that tells how the rig moved meanwhile
    places = np.linspace(0, max(last - 1, 0), min(count, max(last, 1))).round().astype(int)
    chosen, far = [], Counter()
    for place in np.unique(places):
        at = reference[place]
        row: list[tuple[str, int] | None] = [(rig.topics[0], at)]
        for topic, stamps in zip(rig.topics[1:], others, strict=True):
            near = nearest(stamps, at, period)
            far[topic] += near is None
            row.append(None if near is None else (topic, near))
        around = [place + 1, place - 1 if place else place + 2]
        chosen.append((row, [(rig.topics[0], reference[k]) for k in around if 0 <= k <= last]))
    rig.flaws += [
        f'{topic} has no cloud within a period, {period / SECOND:.3g} s, of the reference at '
        f'{n} of {len(chosen)} instants'
        for topic, n in far.items()
        if n
    ]
    if all(each is None for row, _ in chosen for each in row[1:]):
        raise UnusableRig(
            f'no cloud of another sensor is within a period, {period / SECOND:.3g} s, of one of '
            f'{rig.topics[0]}: {"; ".join(rig.flaws)}'
        )
    return chosen


def _measured(recording, rig, wanted, point_times, prepare):
    """Return {(topic, stamp): `Measured`} of the clouds that are wanted, times after the stamp."""
    found = {}
    for topic, _, message in recording.messages(rig.topics):
        key = topic, stamp_ns(message)
        if key not in wanted or key in found:
            continue
        try:
            found[key] = measured_in(message, point_times, prepare)
        except IdemError as error:
            rig.flaws.append(f'{topic} at {key[1] / SECOND:.3f} s is left out: {error}')
    return found


def _at(measured, key, instant):
    """Return a `Measured` whose times are after an instant [ns]; None: there is none."""
    return None if measured is None else measured.later((key[1] - instant) / SECOND)


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
