"""What the balls of each region of space pull, and how firmly: the samples of the jackknife.

Regions are wide, because neighbours err alike: they share points, rings of a scan and the flaws of
a wall.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import (
    Centres,
    Floats,
    Integers,
    Matrix6,
    MomentRows,
    Points,
    Transform,
)
from idem_ros.core.jit import kernel
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.moments import point_of, row_of
from idem_ros.core.metric.noise import holds_line
from idem_ros.core.solve.block_sums import SUMS, of_both
from idem_ros.core.solve.centre_groups import dealt_out
from idem_ros.core.solve.cost import JointEntropy, Linearization
from idem_ros.core.solve.linearization import linearize
from idem_ros.core.trust.observability import Observability
from idem_ros.core.workers import in_threads

# Edge of the cubes that err together: of the lever arm, and of the radius at least.
REGION, LEAST_REGION = 0.27, 3.0
WHOLE = 16  # regions along each axis, before they repeat: a power of two, more than most scenes


class Regions(NamedTuple):
    """What is linearised of the balls in each of G regions."""

    pulls: Floats  # (G, 6): gradients
    stiffness: Floats  # (G, 6, 6): Gauss-Newton matrices
    places: Points  # (G, 3): the mean of the centres, in the frame at the target's origin
    ruled: Matrix6  # (6, 6): what of all stiffness balls have that hold a line
    total: Linearization  # of them all


def by_region(
    cost: JointEntropy,
    T_target_source: Transform,
    observability: Observability,
    met: Sequence[MomentRows],
) -> Regions:
    """Return the `Regions` of a pose.

    met: moments of the two clouds' `Meeting` there.
    """
    balls, T = cost.balls, np.ascontiguousarray(T_target_source)
    groups, places = groups_of(balls, T, observability, WHOLE)
    count = 2 * len(places)
    sums = np.zeros((2, 2, len(places), SUMS))  # of either cloud, and of surfaces and lines
    of_sides = tuple(sums.reshape(2, 1, count, SUMS))
    what = balls.sides(T), tuple(met), T[None], cost.ball_cost
    in_threads(
        balls.workers,
        lambda share: linearize(*what, share, groups, of_sides),
        dealt_out(groups, count, balls.workers),
    )
    here, there = sums
    _, pulls, stiffness = of_both(here, there, T[None])
    here, there = sums[:, 1:].sum(axis=2, keepdims=True)
    _, _, (ruled,) = of_both(here, there, T[None])
    total = Linearization(pulls.sum(axis=0), stiffness.sum(axis=0))
    return Regions(pulls, stiffness, places, ruled, total)


def groups_of(
    balls: Balls, T_target_source: Transform, observability: Observability, period: int
) -> tuple[tuple[Integers, Integers], Points]:
    """Return which group each of the target's centres is in, and each of the source's.

    The number of its region, 0 to G - 1, and G more where its ball holds a line.

    Args:
        balls: `Balls` whose centres they are.
        T_target_source: (4, 4) where regions are looked at.
        observability: there, whose lever arm tells how wide they are.
        period: regions along each axis, after which they repeat: a power of two.

    Returns:
        The groups; and the mean (G, 3) of each region's centres, in the target's frame.
    """
    edge = max(REGION * observability.lever_arm, LEAST_REGION * balls.radius)
    target, source = balls.clouds
    clouds = (target.grid.points, target.own), (source.grid.points, source.own)
    here, there, places = _grouped(clouds, T_target_source, edge, period)
    return (here, there), places


@kernel
def _grouped(
    clouds: tuple[Centres, Centres], T: Transform, edge: float, period: int
) -> tuple[Integers, Integers, Points]:
    most, of_edge, place = period**3, 1.0 / edge, np.empty(3)
    sums, count, number = np.zeros((most, 3)), np.zeros(most), np.empty(most, np.int64)
    groups = np.empty(len(clouds[0][0]), np.int64), np.empty(len(clouds[1][0]), np.int64)
    for s in range(2):
        (points, own), group = clouds[s], groups[s]
        to_target = np.eye(4) if s == 0 else T
        for i in range(len(points)):
            x, y, z = point_of(points, i)
            region = 0
            for axis in range(2, -1, -1):
                row = to_target[axis]
                place[axis] = row[0] * x + row[1] * y + row[2] * z + row[3]
                cell = np.int64(np.floor(place[axis] * of_edge))
                region = period * region + (cell & (period - 1))
            count[region] += 1.0
            for axis in range(3):
                sums[region, axis] += place[axis]
            group[i] = 2 * region + holds_line(row_of(own, i))
    n = 0
    for region in range(most):  # those of some centre alone, in a row
        number[region] = n
        if count[region] > 0.0:
            for axis in range(3):
                sums[n, axis] = sums[region, axis] / count[region]
            n += 1
    for group in groups:
        for i in range(len(group)):
            group[i] = number[group[i] // 2] + n * (group[i] % 2)
    return groups[0], groups[1], sums[:n].copy()
