"""Regions of space: how the balls of each pull on all clouds, and hold them in their places."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Integer, Integers, Integers32, Symmetric, Transforms
from idem_ros.core.geometry.symmetric3 import times
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.metric.candidates import Candidates
from idem_ros.core.metric.moments import point_of
from idem_ros.core.several.joint_balls import SHARES, JointBalls, Lists, Placed
from idem_ros.core.several.joint_candidates import Centres
from idem_ros.core.several.joint_linearization import (
    BLOCK_SUMS,
    accumulate,
    ball_of,
    members_by_cloud,
)
from idem_ros.core.solve.ball_cost import BallCost

PERIOD = 8  # regions along each axis, after which they repeat


class Regions(NamedTuple):
    """The balls of several clouds at poses, sorted into cubes of space."""

    balls: JointBalls
    ball_cost: BallCost
    lists: Lists
    placed: Placed
    region: Integers  # (N,): which one each point is in


def regions_at(balls: JointBalls, ball_cost: BallCost, poses: Transforms, edge: float) -> Regions:
    """Return the `Regions` at poses (K, 4, 4): cubes of an edge."""
    lists, placed = balls.placed(poses)
    x, y, z = np.floor(placed.points / edge).astype(np.int64).T % PERIOD
    return Regions(balls, ball_cost, lists, placed, (z * PERIOD + y) * PERIOD + x)


def pulls_of(regions: Regions) -> Floats:
    """Return the gradient (G, K, 6) of each region, about the common origin."""
    balls, lists = regions.balls, regions.lists
    pulls = np.zeros((PERIOD**3, balls.count, 6))
    blocks = np.zeros((len(lists.pairs), BLOCK_SUMS))
    for share in range(SHARES):
        for centres, candidates in balls.blocks(lists, share):
            what = regions.placed, candidates, centres, regions.region, regions.ball_cost
            accumulate(*what, (lists.pair_of, len(centres.place)), (pulls, blocks))
    return pulls


def stiffness_along(regions: Regions, moves: Floats) -> Floats:
    """Return xi^T H_g xi, (G,), of each region's part of the matrix along a motion of its own.

    moves: (G, K, 6), twists (omega, v) of each cloud about the common origin.
    """
    found, balls = np.zeros(len(moves)), regions.balls
    for share in range(SHARES):
        for centres, candidates in balls.blocks(regions.lists, share):
            what = regions.placed, candidates, centres, regions.region, regions.ball_cost
            _add_along(*what, moves, found)
    return found


@kernel
def _add_along(
    placed: Placed,
    candidates: Candidates,
    centres: Centres,
    region: Integers,
    cost: BallCost,
    moves: Floats,
    found: Floats,
) -> None:
    """Add what a block of balls has of each region's stiffness along its motion to found (G,)."""
    first, member = candidates
    count = moves.shape[1]
    moments, seen = np.empty((count, 10)), np.empty(count, np.int32)
    i: int
    for k, i in enumerate(centres.place):
        n = members_by_cloud(placed, i, (first[k], first[k + 1]), member, cost.r2, moments, seen)
        if n == 0:
            continue
        (f, w), joint = ball_of(placed, i, cost, seen[:n], moments)
        if f > 0.0:
            clouds = seen[:n], moments, placed.cloud[i], placed.own[i, 0]
            along = _along(point_of(placed.points, i), w, joint[0], clouds, moves[region[i]])
            found[region[i]] += centres.weight[k] * f * along


@inlined
def _along(
    p: tuple[float, float, float],
    w: Symmetric,
    weight: float,
    clouds: tuple[Integers32, Floats, Integer, float],
    moves: Floats,
) -> float:
    """Return sum_b n_b u_b^T W u_b - (sum_b n_b u_b)^T W (sum_b n_b u_b) / N.

    u_b: how a ball's centre p moves with cloud b; weight: N; clouds: those seen, their moments
    (K, 10), the ball's own one and its weight.
    """
    seen, moments, own, n_own = clouds
    total, mx, my, mz = 0.0, 0.0, 0.0, 0.0
    for q in range(len(seen) + 1):
        b, n_b = own, n_own
        if q < len(seen):
            b, n_b = seen[q], moments[seen[q], 0]
        m = moves[b]
        x = m[3] + m[1] * p[2] - m[2] * p[1]
        y = m[4] + m[2] * p[0] - m[0] * p[2]
        z = m[5] + m[0] * p[1] - m[1] * p[0]
        wx, wy, wz = times(w, x, y, z)
        total += n_b * (x * wx + y * wy + z * wz)
        mx, my, mz = mx + n_b * x, my + n_b * y, mz + n_b * z
    wx, wy, wz = times(w, mx, my, mz)
    return total - (mx * wx + my * wy + mz * wz) / weight
