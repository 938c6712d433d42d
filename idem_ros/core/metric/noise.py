"""How much of a ball is noise: the thickness of surfaces, and the wider ball it asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, MomentRows, Moments, Symmetric
from idem_ros.core.geometry.symmetric3 import adjugate, determinant, trace
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.metric.moments import covariance, row_of
from idem_ros.core.tuning import SOLVER, SolverTuning

if TYPE_CHECKING:
    from idem_ros.core.metric.cloud import Cloud


QUARTILE = 0.25  # the flattest balls hold noise alone; the others edges, curvature, leaves
LEAST_MEMBERS = 5  # three of k fix a plane: what is left of k / (k - 3) tells its noise
# Members along a line, as one ring of a LiDAR leaves them, lie on the ring's cone: no noise shows.
LEAST_SPREAD = 0.08  # of the second axis against the first, about
# Balls of real scans and simulated ones have 0.00 to 0.27, of points at random in a volume 0.85
# to 0.95, in the median.
ISOTROPIC = 0.6
BINS, FEW = 256, 32  # of a histogram; values that are sorted one by one
SAMPLE, SHAPES = 512, 2000  # balls of each cloud, about: for their thickness, for their shape


def widening(target: Cloud, source: Cloud, radius: float, tuning: SolverTuning = SOLVER) -> float:
    """Return by how much to widen balls of a radius for the noise of two `Cloud`s."""
    found = [cloud.thickness(radius) for cloud in (target, source)]
    wanted = widening_for(max(s for s, _ in found), sum(k for _, k in found), radius, tuning)
    return min(wanted, tuning.most_widening)


def widening_for(
    thickness: float, members: float, radius: float, tuning: SolverTuning = SOLVER
) -> float:
    """Return by how much balls would be widened for surfaces that are as thick, 1 at least.

    members: of a ball.
    """
    wanted = np.sqrt(tuning.noise_ratio * thickness / (radius * np.sqrt(members or np.inf)))
    return float(max(wanted, 1.0))


def thickness_and_members(own: MomentRows) -> tuple[float, float]:
    """Return the lower quartile of balls' thickness, and the median of their members.

    own: (N, 10) moments of the balls.
    """
    squares, members = _of_sheets(own)
    if len(squares) == 0:
        return 0.0, 0.0
    return float(np.sqrt(quantile(squares, QUARTILE))), quantile(members, 0.5)


class Shapes(NamedTuple):
    """What the balls of a cloud hold that have a few points; shares, 0 to 1."""

    surfaces: float  # that hold a surface; the others lines
    volumes: float  # of those not in a row, that spread along all axes alike


def shapes_of(own: MomentRows) -> Shapes:
    """Return the `Shapes` of balls, by a sample: of some thousand a share is known well.

    own: (N, 10) moments of the balls.
    """
    balls, surfaces, spread, volumes = _shapes(own, max(len(own) // SHAPES, 1))
    return Shapes(surfaces / max(balls, 1), volumes / max(spread, 1))


def quantile(values: Floats, share: float) -> float:
    """Return what `np.quantile` does of values (n,), one at least, in a third of the time."""
    at = share * (len(values) - 1)
    lower, upper = _of_rank(values, int(at))
    return float(lower + (at - int(at)) * (upper - lower))


@kernel
def _of_rank(values: Floats, rank: int) -> tuple[float, float]:
    """Return the value of a rank, from 0, among values (n,), and of the next, or last, rank.

    By the histogram's bin that it is in, again and again, until a few are left to be sorted.
    """
    some, count = values.copy(), np.empty(BINS, np.int64)
    n, before, left = len(some), 0, rank
    while n > FEW and n != before:
        before, low, high = n, some[0], some[0]
        for i in range(n):
            low, high = min(low, some[i]), max(high, some[i])
        of_width = BINS / (high - low)
        for b in range(BINS):
            count[b] = 0
        for i in range(n):
            count[_bin((some[i] - low) * of_width)] += 1
        b = n = 0
        while left >= count[b]:
            left -= count[b]
            b += 1
        for i in range(before):
            value = some[i]
            some[n] = value  # kept only if it is counted
            n += _bin((value - low) * of_width) == b
    for i in range(1, n):
        value, k = some[i], i
        while k > 0 and some[k - 1] > value:
            some[k] = some[k - 1]
            k -= 1
        some[k] = value
    lower, upper, below = some[left], np.inf, 0
    for value in values:
        below += value <= lower
        upper = min(upper, value) if value > lower else upper
    return lower, lower if below > rank + 1 or below == len(values) else upper


@inlined
def _bin(place: float) -> int:
    return min(max(int(place), 0), BINS - 1)


@inlined
def holds_line(own: Moments) -> bool:
    """Whether a ball of these moments holds no surface, as those of one ring of a LiDAR."""
    if own[0] < LEAST_MEMBERS:
        return True
    s = covariance(own)
    return not trace(adjugate(s)) > LEAST_SPREAD * trace(s) ** 2


@inlined
def sheet_variance(s: Symmetric, k: float) -> float:
    """Return the squared thickness of the sheet that k points of a covariance lie in; -1: a line.

    det S over the sum of its principal minors is the least eigenvalue where it is much the least.
    """
    minors = trace(adjugate(s))
    if not minors > LEAST_SPREAD * trace(s) ** 2:
        return -1.0
    return max(determinant(s), 0.0) / minors * k / (k - 3.0)


@kernel
def _of_sheets(own: MomentRows) -> tuple[Floats, Floats]:
    """Return the squared thickness of those balls that hold a sheet, and all balls' members."""
    squares, members = np.empty(len(own)), np.empty(len(own))
    n = m = 0
    for i in range(len(own)):
        k = own[i, 0]
        if k < LEAST_MEMBERS:
            continue
        members[m] = k
        m += 1
        square = sheet_variance(covariance(row_of(own, i)), k)
        if square >= 0.0:
            squares[n] = square
            n += 1
    return squares[:n], members[:m]


@kernel
def _shapes(own: MomentRows, stride: int) -> tuple[int, int, int, int]:
    """Count every so-many-th ball: of a few points, surfaces among them, not in a row, volumes.

    With S the covariance of a ball and minors the sum of its principal ones, its isotropy is
    9 det(S) / (minors(S) trace(S)): 0 on a surface, 1 where all axes are alike.
    """
    balls = surfaces = spread = volumes = 0
    for i in range(0, len(own), stride):
        if own[i, 0] < LEAST_MEMBERS:
            continue
        balls += 1
        s = covariance(row_of(own, i))
        minors, along = trace(adjugate(s)), trace(s)
        surfaces += minors > LEAST_SPREAD * along * along
        if minors > 0.0:
            spread += 1
            volumes += 9.0 * determinant(s) > ISOTROPIC * minors * along
    return balls, surfaces, spread, volumes
