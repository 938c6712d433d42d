"""One pass over a recording: what its messages complete is registered in every way asked for."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from itertools import chain

from idem_ros.core import IdemError, RegistrationConfig, warm_up
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.pair import Refusal
from idem_ros.pairing.pairing import PairingConfig
from idem_ros.recording.reader import open_recording
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.replay.frames import Frames, Replay
from idem_ros.replay.pairs import Pairs, messages_of
from idem_ros.replay.sequence import Scans
from idem_ros.replay.settings import Settings
from idem_ros.replay.spool import Spool
from idem_ros.replay.truths import Truths
from idem_ros.terminal.interrupts import held_back

Progress = Callable[[Iterable, int], Iterable]


class Selection:
    """Says of one source after the other whether it is to be refined.

    Args:
        settings: `Settings`.
        begin: of the recording [ns].

    Attributes:
        left_out: sources that are not.
    """

    def __init__(self, settings, begin):
        self._settings = settings
        self._first = begin + round(settings.start * 1e9)
        seconds = settings.duration
        self._end = math.inf if seconds is None else self._first + round(seconds * 1e9)
        self._inside = 0
        self.left_out = 0

    def takes(self, log_time):
        """Return whether the next source is to be refined; log_time [ns]."""
        taken = False
        if self._first <= log_time < self._end:
            taken = self._inside % self._settings.every == 0
            self._inside += 1
        self.left_out += not taken
        return taken

    def is_over(self, log_time):
        """Return whether no source from log_time [ns] on is to be refined."""
        return log_time >= self._end

    def notes(self):
        """Return what was left out, in a sentence; none where nothing was."""
        if not self.left_out:
            return []
        start, duration, every = (
            self._settings.start,
            self._settings.duration,
            self._settings.every,
        )
        until = '' if duration is None else f' for {duration:g} s'
        taken = f'one in {every} is taken, from {start:g} s on{until}'
        return [f'{self.left_out} sources left out: {taken}']


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


def replay_each(path, settings, *, progress: Progress = silent, **topics):
    """Replay a recording in several ways at once; of pairs none is dropped for want of time.

    What is registered are its `Pairs`, or with `sequence` in the settings its `Scans`. Ctrl-C
    ends the pass; what was done is returned, and says so.

    Args:
        path: a recording, as `open_recording` takes it.
        settings: [`Settings`]; the first says what is registered and how it is paired.
        progress: wraps the iteration over `total` messages to show how far it is.
        topics: {role + '_topic': name, or None: found by type}; of pairs `target_topic`,
            `source_topic`, `guess_topic`, `truth_topic` and `tf_topic` (names of topics of
            transforms), of a sequence `source_topic` and `truth_topic`; of pairs `guesses`, too,
            see `Pairs`.

    Returns:
        [`Replay`] of each settings, of the same pairs or scans.

    Raises:
        UnreadableRecording, UnreadableTopic, TopicNotFound: there is nothing to replay.
        UselessTopic: a target or a guess is named, and a sequence has neither.
        PeersMissing: small_gicp is asked for and not installed.
    """
    first = settings[0]
    with open_recording(path, first.max_chunk) as recording:
        pairing = (Pairs if first.sequence is None else Scans)(recording, first, **topics)
        lanes = [_Lane(each, pairing.refiner(each)) for each in settings]
        total = sum(recording.topics[name].count for name in pairing.topics.names)
        messages = progress(messages_of(recording, pairing.topics), total)
        for each in settings:
            warm_up(each.config.motion)
        pass_ = _Pass(pairing, lanes, Selection(first, recording.begin))
        interrupted = pass_.run(messages)
        return pass_.finished(recording, interrupted)


@dataclass
class _Lane:
    """One way to register, and what came of it."""

    settings: Settings
    refine: Callable
    results: Spool = field(default_factory=Spool)
    """Of (log time, `Refinement`)."""
    refused: Spool = field(default_factory=Spool)
    lost: int = 0
    """How many sources were lost, see `Refinement.lost`."""
    why_lost: str = ''
    """Of the first of them."""

    def outcome(self, item):
        """Return a `Refinement`, a `Refusal`, or None of the first scan."""
        try:
            return self.refine(item)
        except IdemError as error:
            return Refusal(item.stamp, str(error))

    def keep(self, log_time, outcome):
        if isinstance(outcome, Refusal):
            self.refused.append(outcome)
        elif outcome is not None:
            # of the path of a solve no record is made
            result = replace(outcome.result, path=outcome.result.path[:0])
            self.results.append((log_time, replace(outcome, result=result, took_part=None)))
            self.lost += bool(outcome.lost)
            self.why_lost = self.why_lost or outcome.lost

    def notes(self):
        """Yield what a reader should know of what came of it."""
        if self.lost:
            yield f'{self.lost} sources were lost; the first: {self.why_lost}'


@dataclass
class _Pass:
    """The state of one pass: the truth of a source may come after its result."""

    pairing: Pairs | Scans
    lanes: list[_Lane]
    selection: Selection
    truths: Truths = field(default_factory=Truths)

    def run(self, messages):
        """Take every message; return whether somebody interrupted it."""
        try:
            with held_back() as interrupted:
                log_time = 0
                for topic, log_time, message in messages:
                    if interrupted() or self._is_complete(log_time):
                        break
                    self._take(topic, log_time, message)
                if not interrupted():
                    self._refine(self.pairing.rest(), log_time)
                return interrupted()
        except KeyboardInterrupt:
            return True

    def _is_complete(self, log_time):
        if not self.selection.is_over(log_time) or self.pairing.waiting:
            return False
        return not self.pairing.topics.truth or self.truths.came_for(self.pairing.awaited)

    def _take(self, topic, log_time, message):
        topics = self.pairing.topics
        if topic == topics.truth:
            self.truths.add(message)
        elif topic == topics.source and not self.selection.takes(log_time):
            self.pairing.leave_out(message)
        else:
            self._refine(self.pairing.completed_by(topic, message), log_time)

    def _refine(self, items, log_time):
        for item in items:
            # all of them first: after an interruption each lane has the same
            outcomes = [lane.outcome(item) for lane in self.lanes]
            for lane, outcome in zip(self.lanes, outcomes, strict=True):
                lane.keep(log_time, outcome)

    def finished(self, recording, interrupted):
        """Return the [`Replay`] of each lane."""
        self.truths = self.pairing.in_one_frame(self.truths)
        replays = [self._finished(lane, recording, interrupted) for lane in self.lanes]
        notes = ['interrupted: what came later in the recording is not in here'] * interrupted
        notes += [*self.pairing.notes(), *self.selection.notes()]
        notes += [*self.truths.notes, *recording.warnings]
        return [replace(each, notes=(*each.notes, *notes)) for each in replays]

    def _finished(self, lane, recording, interrupted):
        truth_of, sequence, notes = self.pairing.judged(lane.settings, lane.results, self.truths)
        # of each: why it is not believed is among the notes
        believed = [truth_of(refinement) is not None for _, refinement in lane.results]
        if self.pairing.topics.truth and believed and not (any(believed) or self.truths.notes):
            notes = (*notes, 'the truth has no pose of the stamp of any source')
        return Replay(
            path=str(recording.path),
            topics=self.pairing.topics,
            frames=Frames(lane.results, truth_of),
            refused=Spool(chain(self.pairing.refused, lane.refused)),
            notes=(*notes, *lane.notes()),
            method=lane.settings.method,
            interrupted=interrupted,
            sequence=sequence,
            lost=dict(recording.lost),
            **self.pairing.left(),
        )
