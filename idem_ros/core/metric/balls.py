"""The balls of one radius around the points of two clouds, and their members from both."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Indices,
    MomentRows,
    Point,
    Points,
    RotationMatrix,
    Side,
    Sides,
    Transform,
    Transforms,
)
from idem_ros.core.geometry import se3
from idem_ros.core.metric.candidates import (
    SKIN,
    CandidatePairs,
    Candidates,
    candidate_pairs,
    still_hold,
)
from idem_ros.core.metric.cloud import Cloud, Neighbourhoods, neighbourhoods
from idem_ros.core.metric.entropy import differences_at_each, fill_agreement
from idem_ros.core.metric.measured_points import mean_and_variance, usual
from idem_ros.core.metric.moments import TIE
from idem_ros.core.metric.noise import Shapes, shapes_of
from idem_ros.core.workers import ALONE, Workers, in_blocks


class Meeting(NamedTuple):
    """How the balls of a cloud meet the other cloud at a pose."""

    q: Floats  # (N,): q_i (Eq. 7) of the cloud's points
    reach: Floats  # (N,): the other's points in reach
    # (N, 10), in the order of the grid: moments of those, in their own frame; where there are none
    # the first is 0
    moments: MomentRows


class Balls:
    """The balls of two clouds at one radius, for transforms near one another.

    Transforms are between the frames at the clouds' origins; see `between_origins`.

    Args:
        target, source: `Cloud`s.
        radius: of the balls, > 0, in the clouds' unit.
        workers: for the kernels; the results are the same for any number of threads.

    Attributes:
        of: the `Cloud`s.
        target, source: their `Neighbourhoods`.

    Raises:
        OutOfTime: the workers are late; so do all methods.
    """

    def __init__(
        self, target: Cloud, source: Cloud, radius: float, workers: Workers = ALONE
    ) -> None:
        self.radius, self.r2, self.workers = radius, radius * radius * TIE, workers
        self.of = target, source
        self.target, self.source = neighbourhoods([target, source], radius, workers)
        self._shifted = 0.0  # the farthest that a point was moved by `shift_source`
        self._pairs: CandidatePairs | None = None
        self._sides_of: CandidatePairs | None = None
        self._sides: Sides | None = None
        self._spread: tuple[Point, float] | None = None
        self._shapes: tuple[Shapes, Shapes] | None = None

    @property
    def clouds(self) -> tuple[Neighbourhoods, Neighbourhoods]:
        """Target and source."""
        return self.target, self.source

    def shift_source(self, points: Points, farthest: float) -> None:
        """Move the source's points to (M, 3) in the grid's order, each by its own way.

        The cells that they are looked up in, and their balls' own moments, stay as they are.

        farthest: that any is from where it was in the beginning; less than a fifth of the skin.
        """
        self.source = self.source._replace(grid=self.source.grid._replace(points=points))
        self._shifted, self._sides_of = max(self._shifted, farthest), None
        self._spread = None

    def source_spread(self) -> tuple[Point, float]:
        """Return the mean (3,) of the source's usual points, and their mean square from it.

        In the frame at the source's origin; computed once.
        """
        if self._spread is None:
            self._spread = mean_and_variance(usual(self.source.grid.points))
        return self._spread

    def shapes(self) -> tuple[Shapes, Shapes]:
        """Return the `Shapes` of the target's balls, and of the source's; computed once."""
        if self._shapes is None:
            self._shapes = shapes_of(self.target.own), shapes_of(self.source.own)
        return self._shapes

    def pairs(self, T_target_source: Transform) -> CandidatePairs:
        """Return the `CandidatePairs` near a transform, enumerated again where it has moved."""
        # of a shift: one for the cells, one at the enumeration, one now
        skin = SKIN * self.radius - 3.0 * self._shifted
        if self._pairs is None or not still_hold(self._pairs, T_target_source, skin):
            reach = self.radius * TIE + SKIN * self.radius
            grids = self.target.grid, self.source.grid
            self._pairs = candidate_pairs(*grids, T_target_source, reach, self.workers)
        return self._pairs

    def near(self, T_target_source: Transform) -> tuple[Indices, Indices]:
        """Return which centres of the target, and of the source, have candidates near T."""
        pairs = self.pairs(T_target_source)
        return np.flatnonzero(np.diff(pairs.of_target.first)), np.flatnonzero(
            np.diff(pairs.of_source.first)
        )

    def sides(self, T_target_source: Transform) -> Sides:
        """Return (centres, members) with the target's points as centres, and with the source's.

        Plain tuples, which kernels are called with faster than with named ones: centres are
        points (N, 3) and the moments of their balls in their own cloud (N, 10); members are the
        other cloud's points (M, 3), in its own frame, their weights (M, 7) or (1, 7), and the
        candidates of each centre i, member[first[i]:first[i + 1]], as the arrays first, member.
        """
        pairs = self.pairs(T_target_source)
        if self._sides is None or pairs is not self._sides_of:
            target, source = self.target, self.source
            self._sides = (
                _side(target, source, pairs.of_target),
                _side(source, target, pairs.of_source),
            )
            self._sides_of = pairs
        return self._sides

    def differences(
        self,
        transforms: Transforms,
        chosen: Sequence[Indices],
        of_two: Sequence[Indices] | None = None,
    ) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Return q_i (Eq. 7) and the other's points in reach, (n, K) each, for either cloud.

        Lengths are over the radius; each point counts once, whatever it stands for.

        Args:
            transforms: (K, 4, 4).
            chosen: indices of the target's centres, and of the source's.
            of_two: (n,) of each of these, the first of the two transforms that it is for, and
                K = 2; None: it is for all.
        """
        size, back = (self.radius, self.radius), se3.inverses(transforms)
        here, there = (None, None) if of_two is None else of_two
        return (
            differences_at_each(self.target, self.source, transforms, *size, chosen[0], here),
            differences_at_each(self.source, self.target, back, *size, chosen[1], there),
        )

    def agreement(self, T_target_source: Transform, scale: float) -> tuple[Meeting, Meeting]:
        """Return the `Meeting` of either cloud.

        For q_i and the points in reach each point counts once; lengths are over the scale.
        """
        sides = self.sides(T_target_source)
        motions = zip(*se3.both_ways(T_target_source), strict=True)
        here, there = (
            self._agreement(*each, scale) for each in zip(self.clouds, sides, motions, strict=True)
        )
        return here, there

    def _agreement(
        self,
        centres: Neighbourhoods,
        side: Side,
        motion: tuple[RotationMatrix, Point],
        scale: float,
    ) -> Meeting:
        n, size = len(centres.order), (self.r2, scale)
        found, moments = np.empty((2, n)), np.empty((n, 10))

        def fill(begin: int, end: int) -> None:
            """Fill a block of the centres."""
            fill_agreement(side, centres.unit, motion, size, (begin, end), found, moments)

        in_blocks(n, self.workers, fill)
        in_order = np.empty_like(found)
        in_order[:, centres.order] = found
        return Meeting(in_order[0], in_order[1], moments)


def _side(centres: Neighbourhoods, others: Neighbourhoods, candidates: Candidates) -> Side:
    members = others.grid.points, others.weights, candidates.first, candidates.member
    return (centres.grid.points, centres.own), members


def between_origins(target: Cloud, source: Cloud, T_target_source: Transform) -> Transform:
    """Return the transform, or each of (K, 4, 4), between the frames at two clouds' origins."""
    T = T_target_source.copy()
    T[..., :3, 3] += T[..., :3, :3] @ source.origin - target.origin
    return T


def from_origins(target: Cloud, source: Cloud, T: Transform) -> Transform:
    """Return T_target_source, or each of (K, 4, 4), given that between the clouds' origins."""
    T_target_source = T.copy()
    T_target_source[..., :3, 3] += target.origin - T[..., :3, :3] @ source.origin
    return T_target_source
