"""How a sensor moved during the sweep of a source, as far as guesses or the last results tell."""

from collections import deque
from typing import NamedTuple

from numpy.typing import NDArray

from idem_ros.core.exceptions import IdemError
from idem_ros.core.geometry.se3 import inverse
from idem_ros.messages.stamps import seconds
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.pairing.guesses import UncoveredSweep
from idem_ros.pairing.pair import Pair
from idem_ros.pairing.turn_rates import UnusableRates
from idem_ros.refinement.track import Track, twist_of

BETWEEN_GUESSES = 'guess', 'solve'  # motions that the guesses around a sweep tell
SCANS_KEPT = 8
LONGEST_STEP = 1_000_000_000  # [ns] from one result, or scan, to the next that tell a motion


class UnknownMotion(IdemError):
    """Nothing tells how the sensor moved; it says why."""


class Asked(NamedTuple):
    """A source whose motion is asked for."""

    pair: Pair
    T_guess: NDArray
    """(4, 4), in the target at its stamp."""
    of: tuple
    """What the results share that may be compared."""
    step: int | None
    """See `SweepMotion.step_of`."""


class Result(NamedTuple):
    """Where a source was at the middle of its sweep."""

    of: tuple
    """What the poses share that may be compared."""
    instant: int
    """[ns]"""
    T_target_source: NDArray
    step: int | None
    """See `SweepMotion.step_of`."""


class Scan(NamedTuple):
    """A source that may be a target later."""

    stamp: int
    track: Track | None
    T_middle: NDArray
    """(4, 4), from its pose to that at the middle of its sweep."""


class SweepMotion:
    """Remembers the last two usable results, and how the last sweeps moved.

    Attributes:
        imu_said: (what the IMU told for the last track or None, and the same in words).
        middle: of the last sweep, in seconds after its stamp.
    """

    def __init__(self):
        self._results = deque(maxlen=2)
        self._scans = deque(maxlen=SCANS_KEPT)
        self._last_stamp = None
        self.imu_said, self.middle = (None, ''), 0.0

    def track(self, kind, asked, begin, end):
        """Return the `Track` of a source's sweep.

        Args:
            kind: 'guess', 'last', or 'solve', which starts from either.
            asked: `Asked`.
            begin, end: of the times of its points [s].

        Raises:
            UnknownMotion: nothing tells the motion.
            UncoveredSweep: the guesses do not reach far enough.
        """
        told, pair = self._told(kind, asked, begin, end), asked.pair
        track, self.imu_said = turned(told, pair.rates, pair.stamp, begin, end)
        return track

    def _told(self, kind, asked, begin, end):
        if kind == 'last':
            return self._continued(asked)
        try:
            return _guessed(asked, begin, end)
        except (UnknownMotion, UncoveredSweep):
            if kind == 'guess':
                raise
            return self._continued(asked)

    def of_target(self, asked, middle, reference, track):
        """Return the `Track` of the scan that is a target; None: it is not known.

        Args:
            asked: `Asked`, of the source.
            middle, reference: of the target's times [s].
            track: of the source; that of a scan before it of which nothing was found.
        """
        stamp = stamp_ns(asked.pair.target)
        found = self._scan(stamp)
        if found is not None and found.track is not None:
            return found.track
        if track is None or asked.step is None:
            return None
        self._scans.append(Scan(stamp, track, track.step(reference, middle)))
        return track

    def is_smeared(self, target):
        """Whether a target was a source of which no motion was known, as one without times."""
        found = self._scan(stamp_ns(target))
        return found is not None and found.track is None

    def step_of(self, pair, is_swept):
        """Return how long it is from a pair's target to its source [ns], where the sensor moved.

        None: the target is a map, or a scan that others are registered to as well.

        Args:
            pair: `Pair`.
            is_swept: whether the points of its target have times.
        """
        frames = {each.header.frame_id.lstrip('/') for each in (pair.target, pair.source)}
        at = stamp_ns(pair.target)
        is_last = is_swept and at == self._last_stamp
        return pair.stamp - at if len(frames) == 1 or is_last else None

    def keep(self, asked, undoing, result):
        """Go on from the `Undoing` of a source and what came of its registration."""
        stamp, track = asked.pair.stamp, undoing.track_found(result)
        middle, T_middle = undoing.to_middle(result)
        self.middle = middle
        if result.is_usable:
            T = result.T_target_source @ T_middle
            target = None if asked.step is None else self._scan(stamp - asked.step)
            if target is not None:
                T = inverse(target.T_middle) @ T
            self._results.append(Result(asked.of, stamp + round(1e9 * middle), T, asked.step))
        self._scans.append(Scan(stamp, track, T_middle))
        self._last_stamp = stamp

    def _scan(self, stamp):
        """Return what was noted last of the scan with a stamp [ns]; None: nothing."""
        return next((each for each in reversed(self._scans) if each.stamp == stamp), None)

    def _continued(self, asked):
        results = [each for each in self._results if each.of == asked.of]
        if results and results[-1].step is not None:
            last = results[-1]
            return _constant(
                last.T_target_source, last.step, 'the last result, from scan to scan,'
            )
        if len(results) < 2:
            raise UnknownMotion(f'of two usable results that tell the motion {len(results)} came')
        before, last = results
        age = asked.pair.stamp - last.instant
        if not 0 < age <= LONGEST_STEP:
            raise UnknownMotion(f'the last usable result is {seconds(age)} before the source')
        step = inverse(before.T_target_source) @ last.T_target_source
        return _constant(step, last.instant - before.instant, 'from one usable result to the next')


def turned(track, rates, stamp, begin, end):
    """Return a track that turns as an IMU says, where there is one, and what that is.

    Args:
        track: `Track` that tells where the sensor was.
        rates: `TurnRates`; None: there are none.
        stamp: of the source [ns].
        begin, end: of the times of its points [s].

    Returns:
        `Track`; and (what the IMU told or None, the same in words, or why it tells nothing).
    """
    if rates is None:
        return track, (None, '')
    try:
        stamps, rotations = rates.turns_over(*_instants(stamp, begin, end))
    except UnusableRates as error:
        return track, (None, str(error))
    said = f'the rates of {rates.frame!r} tell the rotation'
    return track.turned((stamps - stamp) / 1e9, rotations), (rotations, said)


def _guessed(asked, begin, end):
    pair = asked.pair
    if asked.step is not None:
        return _constant(asked.T_guess, asked.step, 'the guess, from scan to scan,')
    if pair.guess.trail is None:
        raise UnknownMotion('the guess comes alone, without others before and after it')
    stamps, poses = pair.guess.trail.poses_over(*_instants(pair.stamp, begin, end))
    return Track((stamps - pair.stamp) / 1e9, poses)


def _instants(stamp, *times):
    return [stamp + round(1e9 * time) for time in times]


def _constant(step, duration, what):
    """Return the `Track` of a motion that took so long [ns], and goes on at its speed."""
    if not 0 < duration <= LONGEST_STEP:
        raise UnknownMotion(
            f'{what} it is {seconds(duration)}; what tells a motion takes a second at most'
        )
    return Track.of_twist(twist_of(step, duration / 1e9))
