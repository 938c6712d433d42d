"""Every pair of a recording, in log order, by the path that the live node takes."""

import heapq
from array import array
from dataclasses import replace

import numpy as np

from idem_ros.maps.open_map import open_map
from idem_ros.messages.stamps import seconds
from idem_ros.pairing.guesses import STREAMED
from idem_ros.pairing.pair import refined
from idem_ros.pairing.pairing import Pairing
from idem_ros.recording.messages import transform_message
from idem_ros.recording.topics import FROM_A_FILE, TopicNotFound, find_topics
from idem_ros.refinement.refiner import Refiner
from idem_ros.refinement.sweep_motion import BETWEEN_GUESSES
from idem_ros.replay.peers import method_of
from idem_ros.replay.spool import Spool


class Pairs:
    """What a replay refines where nothing else is asked for: complete pairs.

    Where the guess is to come as a transform, and there is no such topic, each source starts from
    the identity.

    Args:
        recording: an open `Recording`.
        settings: `Settings`, of which it takes how sources are paired.
        guesses: {stamp [ns]: (4, 4)}, from which sources start whatever the recording says; None:
            none.
        **topics: target_topic, source_topic, guess_topic, truth_topic, tf_topic (several names)
            and imu_topic, see `find_topics`.

    Attributes:
        topics: `Topics`.
        awaited: stamps of the sources that were paired [ns].
        refused: [`Refusal`] of sources that no pair was made of.

    Raises:
        TopicNotFound: there is nothing to pair.
        UnusableMap, UnreadableCloud: the map in `target_file` cannot be used.
    """

    def __init__(self, recording, settings, guesses=None, **topics):
        named = {role.removesuffix('_topic'): name for role, name in topics.items()}
        if file := settings.map.target_file:
            if name := named.get('target'):
                raise TopicNotFound(
                    f'{name!r} is given for the target, and the file {file}; choose one'
                )
            named['target'] = FROM_A_FILE
        self.topics = find_topics(recording, guess_type=settings.guess.type, **named)
        self._pairing = Pairing(settings.pairing, settings.guess, settings.map)
        if settings.config.motion in BETWEEN_GUESSES:
            self._pairing.sweeps.configure(settings.point_times)
        if file:
            self._pairing.add_map(open_map(file))
        self._guesses = guesses or {}
        self._inputs = _inputs(self._pairing, self.topics)
        self.awaited, self.refused = array('q'), Spool()
        self._unused = {}  # {role: why the first input of it was refused}, but for sources
        self._timeless = 0  # pairs that start from a guess of stamp 0
        self._times_said = None  # of the first way to refine them
        self._motion = settings.config.motion

    @property
    def waiting(self):
        """How many sources wait for a target or a guess."""
        return self._pairing.waiting

    def refiner(self, settings):
        """Return what refines a `Pair` by `Settings`.

        Raises:
            PeersMissing: small_gicp is asked for and not installed.
        """
        configs = settings.preprocessing, method_of(settings), settings.point_times
        refiner = Refiner(settings.config, True, *configs)
        self._times_said = self._times_said or refiner.times_said
        return lambda pair: refined(refiner.refine, pair, self._pairing)

    def leave_out(self, message):
        """Take a source that is not to be refined: it may be a target all the same."""
        if self.topics.target == self.topics.source:
            self._pairing.add_target(message)

    def completed_by(self, topic, message):
        """Yield the pairs that a message of a topic completes."""
        yield from self._noted(self._inputs[topic](message))

    def rest(self):
        """Yield the pairs that waited for guesses at the end of a sweep: none will come."""
        self._pairing.sweeps.configure(None)
        yield from self._noted(self._pairing.complete())

    def _noted(self, pairs):
        for pair in pairs:
            self.awaited.append(pair.stamp)
            self._timeless += pair.guess.is_timeless
            yield self._from_given(pair)
        for refusal in self._pairing.take_refusals():
            if refusal.role == 'source':
                self.refused.append(refusal)
            else:
                self._unused.setdefault(refusal.role, refusal.reason)

    def _from_given(self, pair):
        T = self._guesses.get(pair.stamp)
        return pair if T is None else replace(pair, guess=replace(pair.guess, T_target_source=T))

    def in_one_frame(self, truths):
        """Return the `Truths` as they are: each pose is in the frame of the source's target."""
        return truths

    def judged(self, settings, results, truths):
        """Return (the truth of a `Refinement`, `Sequence` or None, notes) of a lane."""

        def truth_of(refinement):
            frames = refinement.target_frame, refinement.source_frame
            truth = truths.at(refinement.stamp, *frames)
            return None if truth is None else refinement.at_reference(truth)

        return truth_of, None, ()

    def left(self):
        """Return what became of the sources that are in no pair, as `Replay` has it."""
        waiting = self._pairing.waiting
        return {
            'dropped': self._pairing.dropped,
            'unpaired': waiting,
            'unpaired_for': self._pairing.waiting_for() if waiting else '',
            'unpaired_why': self._pairing.why_it_waits(),
        }

    def notes(self):
        """Yield what a reader should know of the pairs."""
        if _lacks_guess(self._pairing, self.topics):
            yield 'no guess topic: each source starts from the identity'
        elif self._timeless:
            yield (
                f'{self._timeless} sources start from a guess of stamp 0, which serves those of '
                'any stamp'
            )
        again = len(self.awaited) - len(set(self.awaited))
        if again and not self._pairing.jumps:
            yield (
                f'{again} sources have the stamp of one before: nothing tells whose guess and '
                'truth of that stamp are'
            )
        if self.topics.target == self.topics.source:
            yield (
                f'target and source are one topic, {self.topics.source}: each scan is registered '
                'to the one before it, never to itself; --sequence scan chains them'
            )
        if count := self._pairing.refused_targets:
            yield f'{count} targets were refused and not used: {self._unused.get("target", "")}'
        if 'initial_guess' in self._unused:
            yield f'guesses were refused and not used: {self._unused["initial_guess"]}'
        if self._times_said:
            yield from self._times_said.notes_for(self._motion)
        if self._pairing.jumps:
            yield (
                f'the clock of the recording goes back {self._pairing.jumps} times, the last time '
                f'by {seconds(self._pairing.last_jump)}; what was buffered then is forgotten'
            )


def pairs_of(recording, topics):
    """Yield every complete `Pair` of an open recording, in log order.

    Without a guess topic each source starts from the identity.
    """
    inputs = _inputs(Pairing(), topics)
    for topic, _, message in messages_of(recording, topics):
        if topic in inputs:
            yield from inputs[topic](message)


def messages_of(recording, topics):
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
        topics.imu: pairing.add_imu,
        **dict.fromkeys(topics.tf, pairing.add_guess),
        **dict.fromkeys(topics.tf_static, pairing.add_static_transforms),
    }
    return {topic: add for topic, add in inputs.items() if topic}


def _lacks_guess(pairing, topics):
    return pairing.guess_type in STREAMED and topics.guess is None
