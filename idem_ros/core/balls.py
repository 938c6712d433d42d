"""The balls of one radius around the points of two clouds, and their members from both."""

import numpy as np

from idem_ros.core import se3
from idem_ros.core.blocks import ALONE, in_blocks
from idem_ros.core.candidates import SKIN, candidate_pairs, still_hold
from idem_ros.core.cloud import Neighbourhoods, neighbourhoods
from idem_ros.core.entropy import differences_at_each
from idem_ros.core.moments import TIE


class Balls:
    """The balls of two clouds at one radius, for transforms near one another.

    Transforms are between the frames at the clouds' origins; see `between_origins`.

    Args:
        target, source: `Cloud`s.
        radius: of the balls, > 0, in the clouds' unit.
        workers: for the kernels; the results are the same for any number of threads.

    Attributes:
        target, source: their `Neighbourhoods`.

    Raises:
        OutOfTime: the workers are late; so do all methods.
    """

    def __init__(self, target, source, radius, workers=ALONE):
        self.radius, self.r2, self.workers = radius, radius * radius * TIE, workers
        self.target, self.source = neighbourhoods([target, source], radius, workers)
        self._pairs = self._sides_of = self._sides = None

    @property
    def clouds(self) -> tuple[Neighbourhoods, Neighbourhoods]:
        """Target and source."""
        return self.target, self.source

    def pairs(self, T_target_source):
        """Return the `CandidatePairs` near a transform, enumerated again where it has moved."""
        if self._pairs is None or not still_hold(self._pairs, T_target_source, SKIN * self.radius):
            reach = self.radius * TIE + SKIN * self.radius
            grids = self.target.grid, self.source.grid
            self._pairs = candidate_pairs(*grids, T_target_source, reach, self.workers)
        return self._pairs

    def sides(self, T_target_source, pairs=None):
        """Return (centres, members) with the target's points as centres, and with the source's.

        Plain tuples, which kernels are called with faster than with named ones: centres are
        points (N, 3) and the moments of their balls in their own cloud (N, 10); members are the
        other cloud's points (M, 3), in its own frame, their weights (M, 7) or (1, 7), and the
        candidates of each centre i, member[first[i]:first[i + 1]], as the arrays first, member.

        pairs: those to use; None: those near T.
        """
        pairs = self.pairs(T_target_source) if pairs is None else pairs
        if pairs is not self._sides_of:
            target, source = self.target, self.source
            self._sides = (
                _side(target, source, pairs.of_target),
                _side(source, target, pairs.of_source),
            )
            self._sides_of = pairs
        return self._sides

    def differences(self, transforms, chosen):
        """Return q_i (Eq. 7) and the other's points in reach, (n, K) each, for either cloud.

        Lengths are over the radius; each point counts once, whatever it stands for.

        Args:
            transforms: (K, 4, 4).
            chosen: indices of the target's centres, and of the source's.
        """
        size, back = (self.radius, self.radius), se3.inverses(transforms)
        return (
            differences_at_each(self.target, self.source, transforms, *size, chosen[0]),
            differences_at_each(self.source, self.target, back, *size, chosen[1]),
        )

    def agreement(self, T_target_source, scale):
        """Return (q_i, points of the other in reach), (2, N), of every point of either cloud.

        In the order of the cloud's points, each counting once; lengths are over the scale.
        """
        T = np.asarray(T_target_source)[None]
        ways = (self.target, self.source, T), (self.source, self.target, se3.inverses(T))
        return tuple(self._agreement(*way, scale) for way in ways)

    def _agreement(self, centres, others, transforms, scale):
        found = np.empty((2, len(centres.order)))

        def fill(begin, end):
            """Fill a block of the centres."""
            some = np.arange(begin, end)
            each = differences_at_each(centres, others, transforms, self.radius, scale, some)
            found[:, centres.order[begin:end]] = np.array(each)[:, :, 0]

        in_blocks(len(centres.order), self.workers, fill)
        return found


def _side(centres, others, candidates):
    members = others.grid.points, others.weights, candidates.first, candidates.member
    return (centres.grid.points, centres.own), members


def between_origins(target, source, T_target_source):
    """Return the transform between the frames at two clouds' origins."""
    T = T_target_source.copy()
    T[:3, 3] += T[:3, :3] @ source.origin - target.origin
    return T


def from_origins(target, source, T):
    """Return T_target_source, given the transform between the frames at the clouds' origins."""
    T_target_source = T.copy()
    T_target_source[:3, 3] += target.origin - T[:3, :3] @ source.origin
    return T_target_source
