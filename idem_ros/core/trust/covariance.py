"""How far a result may be from the truth: a sandwich, curvature about the scatter of the pull.

At the minimum the pulls of all balls cancel. How much the rest would pull without those of one
region, and how far that would move the result, is a sample of its error: the jackknife. Regions
are wide, because neighbours err alike: they share points, rings of a scan and the flaws of a wall.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.arrays import (
    Floats,
    Indices,
    Integers,
    Matrix6,
    MomentRows,
    Points,
    Transform,
    Twists,
)
from idem_ros.core.blocks import in_threads
from idem_ros.core.geometry import se3
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.metric.candidates import CandidatePairs
from idem_ros.core.metric.noise import lines_among
from idem_ros.core.solve.block_sums import SUMS, of_both
from idem_ros.core.solve.cost import JointEntropy
from idem_ros.core.solve.groups import dealt_out
from idem_ros.core.solve.linearization import linearize, linearize_met
from idem_ros.core.solve.newton import LEAST_STIFFNESS
from idem_ros.core.trust.observability import Observability

# Edge of the cubes that err together: of the lever arm, and of the radius at least.
REGION, LEAST_REGION = 0.27, 3.0
PERIOD = 8  # regions along each axis, after which they repeat: a power of two
WHOLE = 16  # likewise, so many that hardly any scene has more
SAMPLE = 160  # centres of each cloud, about, that the curvature is taken from
STEP = 0.02  # of the radius: between gradients; within the pairs' skin far beyond the arm, too
LEAST_CURVATURE, MOST_CURVATURE = 0.2, 1.5  # of the majoriser's
LEVERAGE = 0.95  # most of a motion's stiffness that one region may have: a finite variance
MOST_RULED = 0.95  # share of a motion's stiffness that lines have: a finite variance
FLOOR = 1e-4  # of the radius: where the solver stops


class Regions(NamedTuple):
    """What is linearised of the balls in each of G regions."""

    pulls: Floats  # (G, 6): gradients
    stiffness: Floats  # (G, 6, 6): Gauss-Newton matrices
    places: Points  # (G, 3): the mean of the centres, in the frame at the target's origin
    ruled: Matrix6  # (6, 6): what of all stiffness balls have that hold a line


def by_region(
    cost: JointEntropy,
    T_target_source: Transform,
    observability: Observability,
    met: Sequence[MomentRows],
) -> Regions:
    """Return the `Regions` of a pose.

    met: moments of the two clouds' `Meeting` there.
    """
    target, source = (cloud.grid.points for cloud in cost.balls.clouds)
    T = np.ascontiguousarray(T_target_source)
    here, there = regions_of(cost, T, observability, WHOLE)
    number = np.zeros(WHOLE**3, np.int64)
    number[here] = number[there] = 1
    some = np.flatnonzero(number)
    number[some] = np.arange(len(some))
    here, there = number[here], number[there]
    centres = tuple((cloud.grid.points, cloud.own) for cloud in cost.balls.clouds)
    groups = tuple(
        2 * region + lines_among(own)
        for region, (_, own) in zip((here, there), centres, strict=True)
    )
    count, motions = 2 * len(some), se3.both_ways(T)
    sums = tuple(np.zeros((2, count, SUMS)))
    what, workers = (centres, tuple(met), motions, cost.ball_cost), cost.balls.workers
    in_threads(
        workers,
        lambda share: linearize_met(*what, share, groups, sums),
        dealt_out(groups, count, workers),
    )
    _, pulls, stiffness = of_both(sums[0][None], sums[1][None], T)
    middles = _middles((target, source), (here, there), T, len(some))
    pulls, stiffness = pulls.reshape(-1, 2, 6), stiffness.reshape(-1, 2, 6, 6)
    ruled = stiffness[:, 1].sum(axis=0)
    return Regions(pulls.sum(axis=1), stiffness.sum(axis=1), middles, ruled)


def regions_of(
    cost: JointEntropy, T: Transform, observability: Observability, period: int = PERIOD
) -> tuple[Integers, Integers]:
    """Return which region each of the target's centres is in, and each of the source's."""
    balls = cost.balls
    edge = max(REGION * observability.lever_arm, LEAST_REGION * balls.radius)
    here = _region_of(balls.target.grid.points, np.eye(4), edge, period)
    there = _region_of(balls.source.grid.points, np.ascontiguousarray(T), edge, period)
    return here, there


def covariance_of(
    cost: JointEntropy,
    T_target_source: Transform,
    observability: Observability,
    regions: Regions,
    in_common: float,
) -> Matrix6:
    """Return the (6, 6) covariance of a result's error, a twist (omega, v) on its left.

    Args:
        cost: that of the last stage.
        T_target_source: (4, 4) where.
        observability: there; along free motions the deviation is as far as the surfaces reach, or
            1 rad: more would leak into what is held, for the axes are not known exactly.
        regions: `by_region` there.
        in_common: as in `TrustTuning`.
    """
    matrix = regions.stiffness.sum(axis=0)
    held, free = firm_and_loose(observability.held, matrix)
    free = np.concatenate([observability.free, free], axis=1)
    firm, roots = curved(cost, T_target_source, held, observability)
    wider = _widening(held, regions.ruled, in_common) @ matrix
    scatter = wider @ scatter_of(regions.pulls, regions.stiffness, firm, roots) @ wider.T
    units = observability.held
    floor = (FLOOR * cost.balls.radius) ** 2 * units @ units.T
    return scatter + floor + observability.lever_arm**2 * free @ free.T


def _widening(held: Twists, ruled: Matrix6, in_common: float) -> Matrix6:
    """Return (6, 6) that, times the matrix, takes errors to those with what lines have in common.

    Rings of both scans draw each other together wherever they fall, alike in all regions, which no
    jackknife sees. Where balls that hold lines have a share s of a motion's stiffness, surfaces
    alone would leave 1 / (1 - s) of its variance. Lines that err as these do, by a share of it
    that they have in common, move the result by s of that: s^2 / (1 - s) more.

    held: (6, k) motions of unit stiffness.
    """
    share, axes = np.linalg.eigh(held.T @ ruled @ held)
    share = np.clip(share, 0.0, MOST_RULED)
    along = held @ axes
    return along * np.sqrt(1.0 + in_common * share**2 / (1.0 - share)) @ along.T


def of_model(error: tuple[float, ...]) -> Matrix6:
    """Return the (6, 6) covariance, x y z rx ry rz, of a length and an angle [deg] an axis."""
    length, degrees = error
    return np.diag(np.repeat([length, np.radians(degrees)], 3) ** 2)


def curved(
    cost: JointEntropy, T_target_source: Transform, held: Twists, observability: Observability
) -> tuple[Twists, Twists]:
    """Return motions (6, k) in which the whole stiffness is the identity, and the curvature is.

    held: (6, k) motions of unit stiffness.
    """
    part, axes = _curvature(cost, T_target_source, held, observability)
    firm = held @ axes
    return firm, firm / np.sqrt(part)


def scatter_of(pulls: Floats, stiffness: Floats, firm: Twists, roots: Twists) -> Matrix6:
    """Return the jackknife's (n, n): the sum over regions of how far the rest would move."""
    n = firm.shape[1]
    shares, along = (firm.T @ stiffness @ firm).reshape(-1, n * n), pulls @ roots
    return roots @ _jackknifed(shares, along) @ roots.T


def firm_and_loose(held: Twists, matrix: Floats) -> tuple[Twists, Twists]:
    """Return motions (n, k) of unit stiffness, of those held, and those without any.

    matrix: (n, n) stiffness.
    """
    stiffness, axes = np.linalg.eigh(held.T @ matrix @ held)
    firm = stiffness > LEAST_STIFFNESS * stiffness.max(initial=0.0)
    return held @ axes[:, firm] / np.sqrt(stiffness[firm]), held @ axes[:, ~firm]


def _curvature(
    cost: JointEntropy, T: Transform, held: Twists, observability: Observability
) -> tuple[Floats, Floats]:
    """Return the curvature over the majoriser's along axes (k, k) of the held motions, (k,).

    The majoriser is wider than the cost: by how much, a sample of the centres tells.
    """
    balls = cost.balls
    moved: Floats = np.linalg.norm(np.linalg.solve(observability.units, held), axis=0)
    steps = STEP * balls.radius / moved
    pairs = balls.pairs(T)
    sizes = [len(cloud.order) for cloud in balls.clouds]
    stride = max(min(sizes) // SAMPLE, 1)
    some = tuple(np.arange(0, size, stride) for size in sizes)
    nobody = tuple(np.zeros(size, np.int64) for size in sizes)
    places = [T, *(se3.exp(move) @ T for move in (steps * held).T)]
    found = [linearized(cost, at, some, nobody, 1, pairs) for at in places]
    pulls = np.concatenate([pull for pull, _ in found])
    stiffness: Matrix6 = found[0][1][0]
    change: Floats = (pulls[1:] - pulls[:1]) / steps[:, None]
    sampled = held.T @ stiffness @ held
    firmness = np.linalg.eigvalsh(sampled)
    if (firmness <= LEAST_STIFFNESS * firmness.max(initial=0.0)).any():  # it met not all surfaces
        return np.ones(len(sampled)), np.eye(len(sampled))
    part, axes = np.linalg.eigh(_symmetric(np.linalg.solve(sampled, change @ held)))
    return np.clip(part, LEAST_CURVATURE, MOST_CURVATURE), axes


def _symmetric(matrix: NDArray[np.floating[Any]]) -> Floats:
    return (matrix + matrix.T) / 2


def linearized(
    cost: JointEntropy,
    T: Transform,
    chosen: Sequence[Indices],
    regions: Sequence[Integers],
    count: int,
    pairs: CandidatePairs | None = None,
) -> tuple[Floats, Floats]:
    """Return gradients (G, 6) and Gauss-Newton matrices (G, 6, 6) of G regions of centres.

    chosen: indices of the target's centres, and of the source's; regions: which one each is in.
    """
    sums = tuple(np.zeros((2, count, SUMS)))
    sides = cost.balls.sides(T, pairs)
    # tuples: of lists the kernel would be compiled once more
    some = tuple(chosen), tuple(regions)
    linearize(sides, se3.both_ways(T), cost.ball_cost, *some, sums)
    _, pulls, stiffness = of_both(sums[0][None], sums[1][None], T)
    return pulls, stiffness


@kernel
def _jackknifed(shares: Floats, pulls: Floats) -> Floats:
    """Return the sum (k, k) of x x^T over regions, (I - LEVERAGE A) x = b of each.

    shares: (G, k k) of A, which are symmetric; pulls: (G, k) of b.
    """
    n = pulls.shape[1]
    total, rest, x = np.zeros((n, n)), np.empty((n, n)), np.empty(n)
    for g in range(len(pulls)):
        for i in range(n):
            x[i] = pulls[g, i]
            for k in range(n):
                rest[i, k] = -LEVERAGE * shares[g, n * i + k]
            rest[i, i] += 1.0
        _solve(rest, x)
        for i in range(n):
            for k in range(n):
                total[i, k] += x[i] * x[k]
    return total


@inlined
def _solve(matrix: Floats, x: Floats) -> None:
    """Replace x (n,) by matrix^-1 x, and the matrix, which is positive definite, by anything."""
    n = len(x)
    for j in range(n):
        for i in range(j + 1, n):
            f = matrix[i, j] / matrix[j, j]
            x[i] -= f * x[j]
            for k in range(j, n):
                matrix[i, k] -= f * matrix[j, k]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= matrix[i, k] * x[k]
        x[i] /= matrix[i, i]


@kernel
def _region_of(points: Points, T: Transform, edge: float, period: int) -> Integers:
    region, of_edge = np.empty(points.shape[0], np.int64), 1.0 / edge
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        number = 0
        for axis in range(2, -1, -1):
            place = T[axis, 0] * x + T[axis, 1] * y + T[axis, 2] * z + T[axis, 3]
            number = period * number + (np.int64(np.floor(place * of_edge)) & (period - 1))
        region[i] = number
    return region


@kernel
def _middles(
    clouds: tuple[Points, Points], regions: tuple[Integers, Integers], T: Transform, count: int
) -> Points:
    """Return the mean (count, 3) of the points of target and source in each region."""
    sums, number = np.zeros((count, 3)), np.zeros(count)
    for s in range(2):
        points, region = clouds[s], regions[s]
        for i in range(points.shape[0]):
            g = region[i]
            number[g] += 1.0
            for k in range(3):
                if s == 0:
                    sums[g, k] += points[i, k]
                else:
                    x, y, z = points[i, 0], points[i, 1], points[i, 2]
                    sums[g, k] += T[k, 0] * x + T[k, 1] * y + T[k, 2] * z + T[k, 3]
    return sums / number.reshape(-1, 1)
