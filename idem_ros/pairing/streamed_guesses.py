"""Guesses that come as messages: buffered by stamp, interpolated to a source's, or doubted."""

from dataclasses import replace

import numpy as np

from idem_ros.messages.stamps import NotYet, seconds
from idem_ros.messages.transform_message import covariance_of, matrix_of, stamp_ns
from idem_ros.pairing.guesses import WALL_CLOCK, Guess, Trail, frames_of
from idem_ros.pairing.pair import frame_contradiction
from idem_ros.pairing.stamped_poses import DoubtfulGuess, StampedPoses, pose_at

FRAMES_KEPT = 8
NAMED = 3  # of other frames


class StreamedGuesses:
    """TransformStamped, PoseWithCovarianceStamped or Odometry, of each pair of frames apart.

    A source is served by those whose frames are its own and its target's, whatever else comes on
    the topic; where clouds or guesses name none, by all that may be meant.
    """

    def __init__(self):
        self._streams = {}  # {(target frame, source frame): _Stream}, the last to receive last
        self._asked = ()  # frames that served the last source

    def __bool__(self):
        return any(map(bool, self._streams.values()))

    def stamps(self, message):
        """Return (stream, stamp) of what a message holds."""
        return [('initial_guess', stamp_ns(message))]

    def add(self, message):
        """Keep a guess; one with stamp 0 serves every source until another of its frames comes.

        Raises:
            InvalidTransform: one with stamp 0 is none; that before serves on.
        """
        frames = _frames(message)
        stream = self._streams.get(frames) or _Stream()
        stream.add(message)
        self._streams.pop(frames, None)
        self._streams[frames] = stream
        if len(self._streams) > FRAMES_KEPT:
            del self._streams[next(each for each in self._streams if each not in self._asked)]

    def forget_after(self, stamp):
        """Forget what is later than a stamp [ns]."""
        for stream in self._streams.values():
            stream.forget_after(stamp)

    def guess_for(self, stamp, target_frame, source_frame, config):
        """Return the `Guess` for a source of a stamp [ns].

        Raises:
            NotYet: none can be made of what has come so far.
            DoubtfulGuess, InvalidTransform: none will do.
        """
        clouds = target_frame, source_frame
        fitting = [k for k in self._streams if not frame_contradiction('guess', k, clouds)]
        self._asked = tuple(fitting[-FRAMES_KEPT:])
        # where none fits, the contradiction is what there is to tell
        streams = [self._streams[frames] for frames in fitting or self._streams]
        stream = streams[0] if len(streams) == 1 else _merged(streams, stamp)
        try:
            return stream.guess_for(stamp, config)
        except NotYet as missing:
            others = [each for each in self._streams if each not in fitting] if fitting else []
            if not others:
                raise
            named = ' and '.join(f'{child!r} in {parent!r}' for parent, child in others[:NAMED])
            reason = f'{missing}; those of other frames do not count: {named}'
            raise NotYet(reason, is_doubtful=True) from missing


class _Stream:
    """Guesses between two frames."""

    def __init__(self):
        self._poses = StampedPoses()
        self._timeless = None
        self._begins_at_zero = False

    def __bool__(self):
        return bool(self._poses) or self._timeless is not None

    def add(self, message):
        """Keep a guess, see `StreamedGuesses.add`.

        Where a source had stamp 0, as under a simulated clock, it is a time like any other.
        """
        if not stamp_ns(message):
            matrix_of(message)
        self._timeless = None if stamp_ns(message) else message
        if self._timeless is None or self._begins_at_zero:
            self._poses.add(message)

    def forget_after(self, stamp):
        """Forget what is later than a stamp [ns]."""
        self._poses.forget_after(stamp)

    def nearest(self, stamp):
        """Return the messages that may serve a source of a stamp [ns], three at most."""
        if not stamp:
            self._begin_at_zero()
        timeless = [] if self._timeless is None else [self._timeless]
        return self._poses.neighbours(stamp) + timeless

    def guess_for(self, stamp, config):
        """Return the `Guess`, see `StreamedGuesses.guess_for`."""
        if not stamp:
            self._begin_at_zero()
        is_time = self._begins_at_zero and stamp < WALL_CLOCK
        if self._timeless is not None and stamp not in self._poses and not is_time:
            guess = _guess_of([self._timeless], matrix_of(self._timeless))
            return replace(guess, is_timeless=True)
        messages = self._around(stamp, config)
        if len({frames_of(message) for message in messages}) > 1:
            raise DoubtfulGuess(
                'those before and after the source are between different frames: '
                + ' and '.join(
                    f'{child!r} in {parent!r}' for parent, child in map(frames_of, messages)
                )
            )
        guess = _guess_of(messages, pose_at(stamp, messages, config))
        return replace(guess, trail=self._trail(stamp, frames_of(messages[0])))

    def _trail(self, stamp, frames):
        near = self._poses.near(stamp)
        stamps = tuple(each for each in near.stamps if frames_of(near[each]) == frames)
        return Trail(stamps, lambda each: matrix_of(near[each]))

    def _around(self, stamp, config):
        try:
            messages = self._poses.around(stamp)
        except NotYet as missing:
            if self._is_one_click:
                hint = 'it is the only one: of initial_guess.type initial_pose it would suffice'
                raise NotYet(f'{missing}; {hint}') from missing
            raise
        _wait_if_apart(stamp, [stamp_ns(message) for message in messages], config)
        return messages

    @property
    def _is_one_click(self):
        return len(self._poses) == 1 and not hasattr(self._poses.newest, 'child_frame_id')

    def _begin_at_zero(self):
        self._begins_at_zero = True
        if self._timeless is not None:
            self._poses.add(self._timeless)


def _wait_if_apart(stamp, stamps, config):
    """Wait for what goes on from the guess before a source, where that after it is of no use.

    Two that no source between them could have near enough are of two clocks, or of a gap.

    Raises:
        NotYet: what would go on from it may still come.
    """
    if config.max_age is None or len(stamps) < 2:
        return
    before, after = stamps
    if after - before > 2e9 * config.max_age >= 2 * (stamp - before):
        raise NotYet(
            f'the nearest before or after the source is {seconds(after - stamp)} off; '
            f'initial_guess.max_age is {config.max_age:g} s',
            is_doubtful=True,
        )


def _merged(streams, stamp):
    """Return one `_Stream` of those messages of several that may serve a source."""
    merged = _Stream()
    for message in [each for stream in streams for each in stream.nearest(stamp)]:
        merged.add(message)
    return merged


def _frames(message):
    target, source = frames_of(message)
    return target.lstrip('/'), source.lstrip('/')


def _guess_of(messages, pose):
    """Return the `Guess` between one or two messages: as unsure as the less sure of them."""
    said = [each for each in map(covariance_of, messages) if each is not None]
    covariance = max(said, key=np.trace) if len(said) == len(messages) else None
    return Guess(pose, *frames_of(messages[0]), covariance=covariance)
