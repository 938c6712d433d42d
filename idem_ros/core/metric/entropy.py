"""The entropy of a ball (Eq. 4), and q_i (Eq. 7) of some points at many poses."""

import numpy as np

from idem_ros.core.arrays import (
    Centres,
    Floats,
    Indices,
    Integers,
    Mask,
    MomentRows,
    Moments,
    Point,
    Points,
    RotationMatrix,
    Rotations,
    Side,
    Transforms,
    Weights,
)
from idem_ros.core.geometry.grid import Grid, neighbours, room_for
from idem_ros.core.geometry.symmetric3 import determinant
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.metric.cloud import Neighbourhoods
from idem_ros.core.metric.moments import (
    AS_MEASURED,
    TIE,
    ball_moments,
    covariance,
    into_frame,
    plus,
    point_of,
    rotated,
    row_of,
)

TWO_PI_E_CUBED = (2.0 * np.pi * np.e) ** 3  # (2 pi e)^N of Eq. 4 in three dimensions
MOST_WITHOUT_ENTROPY = 3  # k <= 3 points lie in a plane: no entropy (after Eq. 4)


@inlined
def entropy(moments: Moments, scale: float) -> float:
    """Eq. 4: h = 1/2 ln((2 pi e)^3 det Sigma + 1), lengths divided by the scale."""
    cube = scale * scale * scale
    return 0.5 * np.log1p(TWO_PI_E_CUBED * _determinant_of(moments) / (cube * cube))


def length_unit(length_scale: str, radius: float) -> float:
    """Return what lengths are divided by before an entropy is taken."""
    return radius if length_scale == 'radius' else 1.0


@kernel
def fill_differences(
    centres: Centres,
    grid: Grid,
    weights: Weights,
    chosen: Indices,
    motions: tuple[Rotations, Points, Indices],
    size: tuple[float, float],
    q: Floats,
    reach: Floats,
) -> None:
    """Eq. 7 at K poses: fill q_i and the other cloud's points in reach, (n, K) each.

    Args:
        centres: points (N, 3), and moments (N, 10) of the balls around them in their own cloud,
            each point counting once.
        grid: the other cloud's `Grid`.
        weights: (1, 7), of which nothing is read.
        chosen: (n,) indices of centres.
        motions: R (L, 3, 3) and t (L, 3) that take the other's frame to that of the centres, and
            which is the first of the K of each centre (n,).
        size: squared radius, and what lengths are divided by.
    """
    (points, own), (R, t, begin), (r2, scale) = centres, motions, size
    found, rows = room_for(grid)
    for c in range(chosen.shape[0]):
        p, alone = point_of(points, chosen[c]), row_of(own, chosen[c])
        h = entropy(alone, scale)
        for k in range(q.shape[1]):
            at = begin[c] + k
            x = into_frame(p, R[at], t[at])
            n = neighbours(x[0], x[1], x[2], grid, r2, found, rows)
            reach[c, k] = n
            q[c, k] = 0.0
            if n > 0:
                m, _ = ball_moments(x, grid.points, weights, found, np.uint64(0), n, r2)
                q[c, k] = entropy(plus(alone, rotated(R[at], m)), scale) - h


@kernel
def fill_agreement(
    side: Side,
    unit: MomentRows,
    motion: tuple[RotationMatrix, Point],
    size: tuple[float, float],
    span: tuple[int, int],
    found: Floats,
    met: MomentRows,
) -> None:
    """Eq. 7 at one pose: fill q_i and the other cloud's points in reach, of centres of a span.

    By the candidates that are enumerated there anyway: nothing is looked up in a grid.

    Args:
        side: of `Balls.sides`.
        unit: (N, 10) moments of the balls in the centres' own cloud, each point counting once.
        motion: R (3, 3) and t (3,) that take the other's frame to that of the centres.
        size: squared radius, and what lengths are divided by.
        span: (begin, end) of the centres.
        found: (2, N): q_i and points in reach, of which those of the span are filled.
        met: (N, 10) likewise: moments of the other cloud's points in reach, in its own frame.
    """
    ((centres, _), (points, weights, first, member)), (R, t), (r2, scale) = side, motion, size
    cube = scale * scale * scale
    unit_of_det = TWO_PI_E_CUBED / (cube * cube)
    for i in range(span[0], span[1]):
        found[0, i] = found[1, i] = met[i, 0] = 0.0
        if first[i] == first[i + 1]:
            continue
        x = into_frame(point_of(centres, i), R, t)
        begin, end = np.uint64(first[i]), np.uint64(first[i + 1])
        m, weighed = ball_moments(x, points, weights, member, begin, end, r2)
        for c in range(10):
            met[i, c] = weighed[c]
        if m[0] == 0.0:
            continue
        found[1, i] = m[0]
        alone = row_of(unit, i)
        det = unit_of_det * _determinant_of(alone)
        more = unit_of_det * _determinant_of(plus(alone, rotated(R, m))) - det
        found[0, i] = 0.5 * np.log1p(more / (1.0 + det))  # one logarithm for the difference of two


@inlined
def _determinant_of(moments: Moments) -> float:
    """Return det Sigma, 0 where so few points have no entropy."""
    if moments[0] <= MOST_WITHOUT_ENTROPY:
        return 0.0
    return max(determinant(covariance(moments)), 0.0)


@kernel
def sums_of_each(q: Floats, reach: Floats, among: Mask) -> tuple[Floats, Integers]:
    """Return sums over rows of q (n, K), and how many of reach (n, K) are above 0, (K,) each.

    among (n,): which rows. Row by row: the same bits for any K.
    """
    total, within = np.zeros(q.shape[1]), np.zeros(q.shape[1], np.int64)
    for i in range(q.shape[0]):
        if among[i]:
            for k in range(q.shape[1]):
                total[k] += q[i, k]
                within[k] += reach[i, k] > 0.0
    return total, within


def differences_at_each(
    centres: Neighbourhoods,
    others: Neighbourhoods,
    transforms: Transforms,
    radius: float,
    scale: float,
    chosen: Indices | None = None,
    of_two: Indices | None = None,
) -> tuple[Floats, Floats]:
    """Return what `fill_differences` does, (n, K) each: q_i and the other's points in reach.

    Args:
        centres, others: `Neighbourhoods` of the two clouds.
        transforms: (K, 4, 4) that take the others' frame to that of the centres.
        radius: of the balls, that of the neighbourhoods.
        scale: what lengths are divided by.
        chosen: (n,) indices of centres; None: all.
        of_two: (n,) the first of the two transforms that each of these is for, and K = 2; None:
            it is for all.
    """
    chosen = np.arange(len(centres.order)) if chosen is None else np.ascontiguousarray(chosen)
    count = len(transforms) if of_two is None else 2
    begin = np.zeros(len(chosen), np.int64) if of_two is None else of_two
    R, t = transforms[:, :3, :3], transforms[:, :3, 3]
    motions = np.ascontiguousarray(R), np.ascontiguousarray(t), begin
    q, reach = np.empty((2, len(chosen), count))
    size = radius * radius * TIE, scale
    own = centres.grid.points, centres.unit
    fill_differences(own, others.grid, AS_MEASURED, chosen, motions, size, q, reach)
    return q, reach
