"""Where a frame was around a stamp, by poses that came; none is read before it is asked for."""

from bisect import bisect_left, bisect_right
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.stamps import seconds

WINDOW = 1_500_000_000  # [ns] before and after a stamp; a sweep lasts a second at most
EXTRAPOLATED = 150_000_000  # [ns] that a motion is taken to go on beyond the first and last pose
MOST = 12  # poses of a sweep; of more, as many


class UncoveredSweep(IdemError):
    """A sweep that no poses say the motion of; the message names the gap."""


@dataclass(frozen=True)
class Trail:
    """The poses of the source frame in a frame that stands still, at some stamps."""

    stamps: tuple[int, ...]
    """Increasing [ns]."""
    pose_at: Callable[[int], NDArray]
    """Returns the (4, 4) pose of one of the stamps."""

    def poses_over(self, begin, end):
        """Return the stamps [ns] (K,) and poses (K, 4, 4) around an interval, two at least.

        Args:
            begin, end: [ns].

        Raises:
            UncoveredSweep: the poses begin too late, or end too early.
            InvalidTransform: one of them is none.
        """
        stamps = self.stamps
        if len(stamps) < 2:
            raise UncoveredSweep(f'of the sweep {len(stamps)} poses came; a motion takes two')
        first = min(max(bisect_right(stamps, begin) - 1, 0), len(stamps) - 2)
        last = max(min(bisect_left(stamps, end), len(stamps) - 1), first + 1)
        for gap, where in (
            (stamps[first] - begin, 'begin after'),
            (end - stamps[last], 'end before'),
        ):
            if gap > EXTRAPOLATED:
                raise UncoveredSweep(
                    f'the poses {where} the sweep does, by {seconds(gap)}; a motion is taken to '
                    f'go on for {seconds(EXTRAPOLATED)}'
                )
        count = min(last + 1 - first, MOST)
        chosen = [stamps[round(each)] for each in np.linspace(first, last, count)]
        return np.array(chosen), np.array([self.pose_at(each) for each in chosen])
