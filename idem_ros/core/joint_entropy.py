"""q_tot of two clouds as a function of the transform between them, and its linearisation."""

import numpy as np

from idem_ros.core import se3
from idem_ros.core.candidates import SKIN, candidate_pairs, still_hold
from idem_ros.core.linearization import SUMS, linearize, unpack
from idem_ros.core.moments import TIE, entropy_difference

NOISE = 0.005  # of the radius: standard deviation added to every axis of a covariance
BLOCK = 2048  # centres summed together: fixed, so that sums do not depend on who computes them


class JointEntropy:
    """The entropy of the joint cloud minus that of its parts, for transforms near one another.

    Transforms are between the frames at the clouds' origins; see `between_origins`.

    Args:
        target, source: `Cloud`s.
        radius: of the balls, > 0, in the clouds' unit.
        length_scale: 'radius' or 'none'.
        skin: how far the source may move, over the radius, before pairs are enumerated again;
            at most SKIN.
    """

    def __init__(self, target, source, radius, length_scale, skin=SKIN):
        self.radius = radius
        self.r2 = radius * radius * TIE
        self.scale = radius if length_scale == 'radius' else 1.0
        self.noise = (NOISE * radius) ** 2
        self.skin = skin * radius
        self.reach = radius * TIE + self.skin
        self.target = target.neighbourhoods(radius, self.scale)
        self.source = source.neighbourhoods(radius, self.scale)
        self.pairs = None

    def per_point(self, T_target_source):
        """Return q_i (Eq. 7) and the other's points in reach, for the target and the source.

        Each a pair of arrays in the order of the cloud's points.
        """
        pairs = self._pairs_at(T_target_source)
        T_source_target = se3.inverse(T_target_source)
        return (
            self._differences(self.target, self.source, pairs.of_target, T_target_source),
            self._differences(self.source, self.target, pairs.of_source, T_source_target),
        )

    def linearize(self, T_target_source):
        """Return gradient (6,) and Gauss-Newton matrix (6, 6) for a twist on the left."""
        pairs = self._pairs_at(T_target_source)
        T_source_target = se3.inverse(T_target_source)
        here = self._linearize(self.target, self.source, pairs.of_target, T_target_source)
        there = self._linearize(self.source, self.target, pairs.of_source, T_source_target)
        # exp(xi) T has the inverse exp(-Ad(T)^-1 xi) T^-1.
        back = se3.adjoint(T_source_target)
        return here[0] - back.T @ there[0], here[1] + back.T @ there[1] @ back

    def _pairs_at(self, T_target_source):
        if self.pairs is None or not still_hold(self.pairs, T_target_source, self.skin):
            self.pairs = candidate_pairs(
                self.target.grid, self.source.grid, T_target_source, self.reach
            )
        return self.pairs

    def _differences(self, centres, others, candidates, T):
        n = len(centres.order)
        sorted_q, sorted_reach, q, reach = np.empty((4, n))
        R, t = np.ascontiguousarray(T[:3, :3]), T[:3, 3].copy()
        entropy_difference(
            centres.grid.points,
            centres.unit_own,
            centres.entropy,
            others.grid.points,
            *candidates,
            R,
            t,
            self.r2,
            self.scale,
            sorted_q,
            sorted_reach,
        )
        q[centres.order], reach[centres.order] = sorted_q, sorted_reach
        return q, reach

    def _linearize(self, centres, others, candidates, T):
        points, n = centres.grid.points, len(centres.order)
        R, t = np.ascontiguousarray(T[:3, :3]), T[:3, 3].copy()
        around = (others.grid.points, others.raw, *candidates, R, t)
        size = (self.r2, self.scale, self.noise)
        sums = np.zeros((-(-n // BLOCK), SUMS))
        for b, begin in enumerate(range(0, n, BLOCK)):
            end = min(begin + BLOCK, n)
            linearize(points, centres.raw_own, *around, *size, begin, end, sums[b])
        return unpack(sums.sum(axis=0))


def between_origins(target, source, T_target_source):
    """Return the transform between the frames at the clouds' origins."""
    T = T_target_source.copy()
    T[:3, 3] += T[:3, :3] @ source.origin - target.origin
    return T


def from_origins(target, source, T):
    """Return T_target_source, given the transform between the frames at the clouds' origins."""
    T_target_source = T.copy()
    T_target_source[:3, 3] += target.origin - T[:3, :3] @ source.origin
    return T_target_source
