"""Refine every pair of a recording, in log order, by the path that the live node takes."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from idem_ros.core import IdemError, warm_up
from idem_ros.evaluation.pose_error import rotation_error_deg, translation_error_m
from idem_ros.guesses import STREAMED, GuessConfig
from idem_ros.pairing import Pairing, Refusal, frame_contradiction
from idem_ros.recording.messages import transform_message
from idem_ros.recording.reader import open_recording
from idem_ros.recording.topics import Topics, find_topics
from idem_ros.refinement import Refinement, Refiner
from idem_ros.stamps import seconds
from idem_ros.transform_message import matrix_of, stamp_ns


@dataclass(frozen=True)
class PoseError:
    """How far a pose is from the truth."""

    translation_m: float
    rotation_deg: float


@dataclass(frozen=True)
class Frame:
    """One refined source of a recording."""

    log_time: int
    """Of the message that completed the pair [ns]."""
    refinement: Refinement
    truth: NDArray | None
    """(4, 4), source in target frame; None where the recording has none for this source."""

    def error_before(self):
        """Return the `PoseError` of the guess, or None without truth."""
        return self._error_of(self.refinement.T_guess)

    def error_after(self):
        """Return the `PoseError` of the result, or None without truth."""
        return self._error_of(self.refinement.result.T_target_source)

    def _error_of(self, transform):
        if self.truth is None:
            return None
        return PoseError(
            translation_error_m(transform, self.truth), rotation_error_deg(transform, self.truth)
        )


@dataclass(frozen=True)
class Replay:
    """What became of a recording's sources; every one of them is counted once."""

    path: str
    topics: Topics
    frames: tuple[Frame, ...]
    refused: tuple[Refusal, ...]
    """Sources with a reason why they were not refined."""
    dropped: int
    """Sources that waited for a target or a guess until newer ones took their place."""
    unpaired: int
    """Sources that still waited when the recording ended."""
    unpaired_for: str
    """What those waited for."""
    notes: tuple[str, ...]
    """What a reader should know of the recording: no guess topic, a missing end."""
    unpaired_why: str = ''
    """Why the newest of those that still waited did."""


def replay(
    path,
    config=None,
    *,
    preprocessing=None,
    pairing=None,
    guess=None,
    target_topic=None,
    source_topic=None,
    guess_topic=None,
    truth_topic=None,
    progress: Callable[[Iterable, int], Iterable] = lambda messages, total: messages,
):
    """Refine every complete pair of a recording; none is dropped for want of time.

    Where the guess is to come as a transform, and there is no such topic, each source starts from
    the identity.

    Args:
        path: a recording, as `open_recording` takes it.
        config: `RegistrationConfig`; None: its defaults.
        preprocessing: `PreprocessingConfig`; None: its defaults.
        pairing: `PairingConfig`; None: its defaults.
        guess: `GuessConfig`; None: its defaults.
        target_topic, source_topic, guess_topic, truth_topic: names; None: found by type.
        progress: wraps the iteration over `total` messages to show how far it is.

    Returns:
        `Replay`

    Raises:
        UnreadableRecording, TopicNotFound: there is nothing to replay.
    """
    guess = guess or GuessConfig()
    given = target_topic, source_topic, guess_topic, truth_topic
    with open_recording(path) as recording:
        topics = find_topics(recording, *given, guess_type=guess.type)
        names = [name for name in vars(topics).values() if name]
        total = sum(recording.topics[name].count for name in names)
        warm_up()
        pass_ = _Pass(topics, Refiner(config, True, preprocessing), Pairing(pairing, guess))
        for topic, log_time, message in progress(recording.messages(names), total):
            pass_.add(topic, log_time, message)
        return pass_.finished(str(path), recording.warnings)


def pairs_of(recording, topics):
    """Yield every complete `Pair` of an open recording, in log order.

    Without a guess topic each source starts from the identity.
    """
    pairing = Pairing()
    inputs = _inputs(pairing, topics)
    for topic, _, message in recording.messages(list(inputs)):
        yield from inputs[topic](message)


def _inputs(pairing, topics):
    """Return what takes the messages of each topic."""
    if _lacks_guess(pairing, topics):
        pairing.add_guess(transform_message(np.eye(4), 0, '', ''))
    inputs = {
        topics.target: pairing.add_target,
        topics.source: pairing.add_source,
        topics.guess: pairing.add_guess,
        topics.tf: pairing.add_guess,
        topics.tf_static: pairing.add_static_transforms,
    }
    return {topic: add for topic, add in inputs.items() if topic}


def _lacks_guess(pairing, topics):
    return pairing.guess_type in STREAMED and topics.guess is None


@dataclass
class _Pass:
    """The state of one replay: the truth of a source may come after its result."""

    topics: Topics
    refiner: Refiner
    pairing: Pairing
    results: list = field(default_factory=list)
    refused: list = field(default_factory=list)
    truths: dict = field(default_factory=dict)
    notes: list = field(default_factory=list)

    def __post_init__(self):
        if _lacks_guess(self.pairing, self.topics):
            self.notes.append('no guess topic: each source starts from the identity')
        self.inputs = _inputs(self.pairing, self.topics)

    def add(self, topic, log_time, message):
        if topic == self.topics.truth:
            self.truths[stamp_ns(message)] = message
            return
        for pair in self.inputs[topic](message):
            try:
                self.results.append((log_time, self.refiner.refine(pair)))
            except IdemError as error:
                self.refused.append(Refusal(pair.stamp, str(error)))
        self.refused.extend(self.pairing.take_refusals())

    def finished(self, path, warnings):
        if self.pairing.jumps:
            self.notes.append(
                f'the clock of the recording goes back {self.pairing.jumps} times, the last time '
                f'by {seconds(self.pairing.last_jump)}; what was buffered then is forgotten'
            )
        frames = tuple(Frame(*result, self._truth_of(result[1])) for result in self.results)
        return Replay(
            path=path,
            topics=self.topics,
            frames=frames,
            refused=tuple(self.refused),
            dropped=self.pairing.dropped,
            unpaired=self.pairing.waiting,
            unpaired_for=self.pairing.waiting_for() if self.pairing.waiting else '',
            notes=(*self.notes, *warnings),
            unpaired_why=self.pairing.why_it_waits(),
        )

    def _truth_of(self, refinement):
        message = self.truths.get(refinement.stamp)
        if message is None:
            return None
        reason = frame_contradiction(
            'truth',
            (message.header.frame_id, message.child_frame_id),
            (refinement.target_frame, refinement.source_frame),
        )
        if not reason:
            try:
                return matrix_of(message)
            except IdemError as error:
                reason = f'truth: {error}'
        if reason not in self.notes:
            self.notes.append(reason)
        return None
