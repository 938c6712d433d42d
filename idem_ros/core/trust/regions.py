"""What the balls of each region of space pull, and how firmly: the samples of the jackknife.

Regions are wide, because neighbours err alike: they share points, rings of a scan and the flaws of
a wall.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Integers, Matrix6, MomentRows, Points, Transform
from idem_ros.core.blocks import in_threads
from idem_ros.core.geometry import se3
from idem_ros.core.jit import kernel
from idem_ros.core.metric.noise import lines_among
from idem_ros.core.solve.block_sums import SUMS, of_both
from idem_ros.core.solve.cost import JointEntropy
from idem_ros.core.solve.groups import dealt_out
from idem_ros.core.solve.linearization import linearize_met
from idem_ros.core.trust.observability import Observability

# Edge of the cubes that err together: of the lever arm, and of the radius at least.
REGION, LEAST_REGION = 0.27, 3.0
PERIOD = 8  # regions along each axis, after which they repeat: a power of two
WHOLE = 16  # likewise, so many that hardly any scene has more


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
