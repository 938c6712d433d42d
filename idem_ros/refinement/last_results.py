"""Guesses that the last results lead to, and when these lead nowhere any more."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.geometry.se3 import exp, inverse, log, rotation_angle
from idem_ros.messages.stamps import seconds
from idem_ros.refinement.diagnostics import headline

AHEAD = 1.0  # [s] of the motion that a map is prepared for
TURN = 0.05  # [rad] that a solve needs no help with


@dataclass(frozen=True)
class _Usable:
    """A result to go on from."""

    stamp: int
    T_target_source: NDArray
    radius: float
    """Of the balls that found it: what moves by less is found from where it was."""


class LastResults:
    """The last usable results between the same frames, and what came after them.

    The guess is the last one. Where results after it were not usable, or the source moves by more
    than a radius from scan to scan, the motion between the last two is carried on: for
    `lost_after` of the guess at most; then it stays, and `keep` says since when and why. Where
    the frames are one, as of scan to scan, the last result is a motion itself.
    """

    def __init__(self):
        self._of: Any = None  # (frames, ...), as `Asked.of`
        self._usable: tuple[_Usable, ...] = ()  # the last two at most, the newest last
        self._failed = ''  # why the newest result is not usable; empty where it is

    def guess_for(self, pair, of):
        """Return the (4, 4) guess of a `Pair`: its own, or where the last results lead.

        Args:
            pair: whose guess may be the last result.
            of: what it and the last results must share.
        """
        if pair.guess.T_target_source is not None:
            return pair.guess.T_target_source
        if of != self._of or not self._usable:
            return np.eye(4) if pair.guess.T_first is None else pair.guess.T_first
        return self._carried_on(pair.stamp, pair.guess.lost_after)

    def keep(self, pair, of, result):
        """Take note of the result of a pair; return why the next guess leads nowhere, or ''."""
        if result.is_usable:
            before = self._usable[-1:] if of == self._of else ()
            self._of, self._failed = of, ''
            self._usable = (*before, _Usable(pair.stamp, result.T_target_source, result.radius))
            return ''
        self._failed = headline(result)
        return self._lost(pair, of)

    def ahead_of(self, T):
        """Return where (4, 4) a source that is at T now will be soon, see `AHEAD`."""
        step, duration = self._motion()
        return T if step is None else T @ _continued(step, AHEAD / duration)

    def _lost(self, pair, of):
        after = pair.guess.lost_after
        is_followed = pair.guess.T_target_source is None and of == self._of and self._usable
        if not is_followed or after is None:
            return ''
        since = self._usable[-1].stamp
        if pair.stamp - since <= after * 1e9:
            return ''
        return (
            f'no usable result for {seconds(pair.stamp - since)}, since the scan at '
            f'{since / 1e9:.3f} s; the last is {self._failed}; a new pose on /initialpose, or '
            '~/reset, begins anew'
        )

    def _carried_on(self, stamp, lost_after):
        last = self._usable[-1]
        step, duration = self._motion()
        if step is None or self._is_scan_to_scan() or not (self._failed or self._is_fast(step)):
            return last.T_target_source
        time = (stamp - last.stamp) / 1e9
        if lost_after is not None:
            time = min(time, lost_after)
        return last.T_target_source @ _continued(step, max(time, 0.0) / duration)

    def _motion(self):
        """Return the (4, 4) motion between the last two results, and how long it took [s]."""
        if len(self._usable) < 2:
            return None, 0.0
        first, last = self._usable
        duration = (last.stamp - first.stamp) / 1e9
        if duration <= 0.0:
            return None, 0.0
        return inverse(first.T_target_source) @ last.T_target_source, duration

    def _is_fast(self, step):
        moved = np.linalg.norm(step[:3, 3]) > self._usable[-1].radius
        return moved or rotation_angle(step) > TURN

    def _is_scan_to_scan(self):
        target_frame, source_frame = self._of[0]
        return target_frame == source_frame


def _continued(step, ratio):
    """Return a (4, 4) motion that lasts `ratio` times as long, by the same twist."""
    return exp(ratio * log(step))
