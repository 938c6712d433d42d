"""How far joint poses may be from the truth: a sandwich, curvature about the scatter of the pull.

As of two clouds (`trust.covariance`): at the minimum the pulls of all balls cancel, and how much
the balls of one region of space pull, on all clouds at once, is a sample of what moves the poses.
"""

from typing import TYPE_CHECKING

import numpy as np

from idem_ros.core.arrays import Floats, Points, Transforms
from idem_ros.core.geometry import se3
from idem_ros.core.several.joint_balls import JointBalls
from idem_ros.core.several.joint_linearization import JointLinearization, linearized_by_group
from idem_ros.core.several.system import JointSystem, about_middles, moved
from idem_ros.core.solve.ball_cost import BallCost
from idem_ros.core.trust.covariance import (
    FLOOR,
    LEAST_CURVATURE,
    LEAST_REGION,
    MOST_CURVATURE,
    PERIOD,
    REGION,
    STEP,
)

PROBES = 5

if TYPE_CHECKING:
    from idem_ros.core.several.joint_descent import JointCost


def nat_at(cost: 'JointCost', poses: Transforms) -> float:
    """Return what of a nat of q_tot is information: by how the pulls of regions scatter.

    The covariance of poses is then about the inverse of this times the matrix: so q_tot and
    priors, whose covariance is known, can be added.
    """
    pulls, _ = _by_region(cost.balls, cost.ball_cost, poses)
    system = cost.system(poses, with_priors=False)
    each = _of_free(pulls, poses, system)
    scatter = float(np.sum(each * system.solved(each)))
    return each.shape[0] / scatter if scatter > 0.0 else 1.0


def joint_covariance(cost: 'JointCost', poses: Transforms) -> Floats:
    """Return the covariance (6 K, 6 K) of the poses of the clouds' frames.

    x y z rx ry rz of each, in the common frame's axes, about the frame's own origin; zero for
    what is held.
    """
    system = cost.system(poses)
    if len(system.free) == 0:
        return np.zeros((6 * len(poses), 6 * len(poses)))
    pulls, _ = _by_region(cost.balls, cost.ball_cost, poses)
    moves = system.solved(_of_free(pulls, poses, system))
    found = moves @ moves.T / _curvature(cost, poses, system, moves) ** 2
    if cost.known.priors:
        of_priors = (system.matrix - cost.system(poses, with_priors=False).matrix).toarray()
        found += system.solved(system.solved(of_priors / cost.nat).T)
    found += np.diag(np.tile(_floor(cost.balls), len(system.free)))
    return _of_frames(found, system, poses, cost.known.origins)


def _curvature(cost: 'JointCost', poses: Transforms, system: JointSystem, moves: Floats) -> float:
    """Return what the curvature is of the majoriser's, along the errors that are likely.

    Along sums of the regions' moves (6 F, G) with random signs, each as far as the solver's balls
    still hold most of their members.
    """
    rng, parts = np.random.default_rng(0), list[float]()
    for signs in rng.choice((-1.0, 1.0), (PROBES, moves.shape[1])):
        move = (moves @ signs).reshape(-1, 6)
        arm = np.r_[np.full(3, lever_arm(cost.balls)), np.ones(3)]
        move *= STEP * cost.balls.radius / max(float(np.abs(move * arm).max()), 1e-300)
        ahead, behind = (
            cost.system(moved(poses, system.free, sign * move)).gradient for sign in (1.0, -1.0)
        )
        along = move.ravel()
        stiffness = float(along @ (system.matrix @ along))
        parts.append(float(along @ (ahead - behind)) / 2 / stiffness if stiffness > 0.0 else 1.0)
    return float(np.clip(np.median(parts), LEAST_CURVATURE, MOST_CURVATURE))


def _floor(balls: JointBalls) -> Floats:
    """Return the least variance (6,), (omega, v): where the solver stops."""
    least = (FLOOR * balls.radius) ** 2
    return np.r_[np.full(3, least / lever_arm(balls) ** 2), np.full(3, least)]


def lever_arm(balls: JointBalls) -> float:
    """Return how far the points of a cloud are from its origin: the median cloud's mean square."""
    ends = np.cumsum(balls.sizes)[:-1]
    lengths = np.linalg.norm(balls.points, axis=1)
    squares = [float(part @ part) / len(part) for part in np.split(lengths, ends)]
    return max(float(np.sqrt(np.median(squares))), balls.radius)


def _by_region(
    balls: JointBalls, ball_cost: BallCost, poses: Transforms
) -> tuple[Floats, JointLinearization]:
    """Return the gradients (G, K, 6) of the regions of space that hold a ball."""
    edge = max(REGION * lever_arm(balls), LEAST_REGION * balls.radius)
    found = linearized_by_group(balls, ball_cost, poses, edge, PERIOD)
    return found.pulls[found.pulls.any(axis=(1, 2))], found


def _of_free(pulls: Floats, poses: Transforms, system: JointSystem) -> Floats:
    """Return gradients (G, K, 6) about the origin as (6 F, G), about the free clouds' middles."""
    about = np.einsum('kji,gkj->gki', about_middles(poses), pulls)[:, system.free]
    return np.ascontiguousarray(about.reshape(len(pulls), -1).T)


def _of_frames(
    covariance: Floats, system: JointSystem, poses: Transforms, origins: Points
) -> Floats:
    """Return the covariance (6 F, 6 F) of twists about middles as (6 K, 6 K), of frames' poses."""
    count = len(poses)
    change = np.zeros((6 * count, 6 * len(system.free)))
    for n, k in enumerate(system.free):
        lever = -poses[k, :3, :3] @ origins[k]
        block = change[6 * k : 6 * k + 6, 6 * n : 6 * n + 6]
        block[:3, :3], block[:3, 3:] = -se3.skew(lever), np.eye(3)
        block[3:, :3] = np.eye(3)
    return change @ covariance @ change.T
