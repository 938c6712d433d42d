"""Refine every pair of a recording, in log order, by the path that the live node takes."""

import heapq
from array import array
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from itertools import chain

import numpy as np

from idem_ros.core import IdemError, RegistrationConfig, warm_up
from idem_ros.messages.stamps import seconds
from idem_ros.pairing.guesses import STREAMED, GuessConfig
from idem_ros.pairing.pair import Refusal, refined
from idem_ros.pairing.pairing import Pairing, PairingConfig
from idem_ros.recording.messages import transform_message
from idem_ros.recording.reader import open_recording
from idem_ros.recording.topics import Topics, find_topics
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.refinement.refiner import Refiner
from idem_ros.replay.frames import Frame, Replay
from idem_ros.replay.peers import method_of
from idem_ros.replay.selection import Selection
from idem_ros.replay.settings import Settings
from idem_ros.replay.spool import Spool
from idem_ros.replay.truths import Truths
from idem_ros.terminal.interrupts import held_back

Progress = Callable[[Iterable, int], Iterable]


def silent(messages, total):
    """Show nothing of how far an iteration is."""
    return messages


def replay(
    path, config=None, *, preprocessing=None, pairing=None, guess=None, progress=silent, **topics
):
    """Refine every complete pair of a recording by IDEM, see `replay_each`.

    Args:
        path: a recording, as `open_recording` takes it.
        config: `RegistrationConfig`; None: its defaults.
        preprocessing: `PreprocessingConfig`; None: its defaults.
        pairing: `PairingConfig`; None: its defaults.
        guess: `GuessConfig`; None: its defaults.
        progress, **topics: see `replay_each`.

    Returns:
        `Replay`
    """
    settings = Settings(
        config or RegistrationConfig(),
        preprocessing or PreprocessingConfig(),
        pairing or PairingConfig(),
        guess or GuessConfig(),
    )
    (replayed,) = replay_each(path, [settings], progress=progress, **topics)
    return replayed


def replay_each(
    path,
    settings,
    *,
    target_topic=None,
    source_topic=None,
    guess_topic=None,
    truth_topic=None,
    tf_topic=None,
    progress: Progress = silent,
):
    """Refine every complete pair of a recording in several ways; none is dropped for want of time.

    Where the guess is to come as a transform, and there is no such topic, each source starts from
    the identity. Ctrl-C ends the replay; what was done is returned, and says so.

    Args:
        path: a recording, as `open_recording` takes it.
        settings: [`Settings`]; the first says which sources are refined and how they are paired.
        target_topic, source_topic, guess_topic, truth_topic: names; None: found by type.
        tf_topic: names of topics of transforms, for guesses from tf; None: see `find_topics`.
        progress: wraps the iteration over `total` messages to show how far it is.

    Returns:
        [`Replay`] of each settings, of the same pairs.

    Raises:
        UnreadableRecording, UnreadableTopic, TopicNotFound: there is nothing to replay.
        PeersMissing: small_gicp is asked for and not installed.
    """
    first = settings[0]
    given = target_topic, source_topic, guess_topic, truth_topic
    lanes = [_Lane(each) for each in settings]
    with open_recording(path, first.max_chunk) as recording:
        topics = find_topics(recording, *given, guess_type=first.guess.type, tf=tf_topic)
        total = sum(recording.topics[name].count for name in topics.names)
        messages = progress(_messages(recording, topics), total)
        warm_up()
        selection = Selection(first, recording.begin)
        pass_ = _Pass(topics, lanes, Pairing(first.pairing, first.guess), selection)
        interrupted = pass_.run(messages)
        return pass_.finished(recording, interrupted)


def pairs_of(recording, topics):
    """Yield every complete `Pair` of an open recording, in log order.

    Without a guess topic each source starts from the identity.
    """
    pairing = Pairing()
    inputs = _inputs(pairing, topics)
    for topic, _, message in _messages(recording, topics):
        if topic in inputs:
            yield from inputs[topic](message)


def _messages(recording, topics):
    """Yield the messages of topics in log order; what is static first, then again in its time.

    A static transform holds from the beginning, however late its publisher was recorded.
    """
    static = list(recording.messages(topics.tf_static)) if topics.tf_static else []
    # of a frame that is given twice, the first is that of the start
    yield from ((topic, recording.begin, message) for topic, _, message in reversed(static))
    others = recording.messages(set(topics.names) - set(topics.tf_static))
    yield from heapq.merge(others, static, key=lambda logged: logged[1])


def _inputs(pairing, topics):
    """Return what takes the messages of each topic."""
    if _lacks_guess(pairing, topics):
        pairing.add_guess(transform_message(np.eye(4), 0, '', ''))
    is_one = topics.target == topics.source
    inputs = {
        topics.target: pairing.add_target,
        topics.source: pairing.add_scan if is_one else pairing.add_source,
        topics.guess: pairing.add_guess,
        topics.initial_pose: pairing.add_guess,
        **dict.fromkeys(topics.tf, pairing.add_guess),
        **dict.fromkeys(topics.tf_static, pairing.add_static_transforms),
    }
    return {topic: add for topic, add in inputs.items() if topic}


def _lacks_guess(pairing, topics):
    return pairing.guess_type in STREAMED and topics.guess is None


class _Lane:
    """One way to refine the pairs, and what came of it."""

    def __init__(self, settings):
        method = method_of(settings)
        self.refiner = Refiner(settings.config, True, settings.preprocessing, method)
        self.method = settings.method
        self.results, self.refused = Spool(), Spool()

    def outcome(self, pair, pairing):
        try:
            return refined(self.refiner.refine, pair, pairing)
        except IdemError as error:
            return Refusal(pair.stamp, str(error))

    def keep(self, log_time, outcome):
        if isinstance(outcome, Refusal):
            self.refused.append(outcome)
        else:
            self.results.append((log_time, outcome))


@dataclass
class _Pass:
    """The state of one replay: the truth of a source may come after its result."""

    topics: Topics
    lanes: list[_Lane]
    pairing: Pairing
    selection: Selection
    truths: Truths = field(default_factory=Truths)
    refused: Spool = field(default_factory=Spool)
    unused: dict[str, str] = field(default_factory=dict)
    """{role: why the first input of it was refused}, but for sources."""
    timeless: int = 0
    """How many of those started from a guess of stamp 0."""
    stamps: array = field(default_factory=lambda: array('q'))
    """Of the sources that were paired [ns]."""

    def __post_init__(self):
        self.inputs = _inputs(self.pairing, self.topics)

    def run(self, messages):
        """Take every message; return whether somebody interrupted it."""
        try:
            with held_back() as interrupted:
                for topic, log_time, message in messages:
                    if interrupted() or self._is_complete(log_time):
                        break
                    self._add(topic, log_time, message)
                return interrupted()
        except KeyboardInterrupt:
            return True

    def _is_complete(self, log_time):
        if not self.selection.is_over(log_time) or self.pairing.waiting:
            return False
        return not self.topics.truth or self.truths.came_for(self.stamps)

    def _add(self, topic, log_time, message):
        if topic == self.topics.truth:
            self.truths.add(message)
            return
        if topic == self.topics.source and not self.selection.takes(log_time):
            if topic == self.topics.target:  # it is the scan before the next one all the same
                self.pairing.add_target(message)
            return
        for pair in self.inputs[topic](message):
            # all of them first: after an interruption each lane has the same pairs
            outcomes = [lane.outcome(pair, self.pairing) for lane in self.lanes]
            self.stamps.append(pair.stamp)
            self.timeless += pair.guess.is_timeless
            for lane, outcome in zip(self.lanes, outcomes, strict=True):
                lane.keep(log_time, outcome)
        for refusal in self.pairing.take_refusals():
            if refusal.role == 'source':
                self.refused.append(refusal)
            else:
                self.unused.setdefault(refusal.role, refusal.reason)

    def finished(self, recording, interrupted):
        replays = [self._finished(lane, recording, interrupted) for lane in self.lanes]
        notes = (*self._notes(interrupted), *self.truths.notes, *recording.warnings)
        return [replace(each, notes=notes) for each in replays]

    def _finished(self, lane, recording, interrupted):
        return Replay(
            path=str(recording.path),
            topics=self.topics,
            frames=Spool(self._frame(*result) for result in lane.results),
            refused=Spool(chain(self.refused, lane.refused)),
            dropped=self.pairing.dropped,
            unpaired=self.pairing.waiting,
            unpaired_for=self.pairing.waiting_for() if self.pairing.waiting else '',
            notes=(),
            unpaired_why=self.pairing.why_it_waits(),
            method=lane.method,
            interrupted=interrupted,
            lost=dict(recording.lost),
        )

    def _frame(self, log_time, refinement):
        frames = refinement.target_frame, refinement.source_frame
        return Frame(log_time, refinement, self.truths.at(refinement.stamp, *frames))

    def _notes(self, interrupted):
        if interrupted:
            yield 'interrupted: what came later in the recording is not in here'
        if _lacks_guess(self.pairing, self.topics):
            yield 'no guess topic: each source starts from the identity'
        elif self.timeless:
            yield (
                f'{self.timeless} sources start from a guess of stamp 0, which serves those of '
                'any stamp'
            )
        if self.topics.target == self.topics.source:
            yield (
                f'target and source are one topic, {self.topics.source}: each scan is registered '
                'to the one before it, never to itself; --sequence scan chains them'
            )
        if count := self.pairing.refused_targets:
            yield f'{count} targets were refused and not used: {self.unused.get("target", "")}'
        if 'initial_guess' in self.unused:
            yield f'guesses were refused and not used: {self.unused["initial_guess"]}'
        if note := self.selection.note():
            yield note
        if self.pairing.jumps:
            yield (
                f'the clock of the recording goes back {self.pairing.jumps} times, the last time '
                f'by {seconds(self.pairing.last_jump)}; what was buffered then is forgotten'
            )
