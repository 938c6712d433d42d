"""How far joint poses may be from the truth: a sandwich, curvature about the scatter of the pull.

As of two clouds (`trust.covariance`): at the minimum the pulls of all balls cancel, and how much
the balls of one region of space pull, on all clouds at once, is a sample of what moves the poses.
With many clouds there are fewer samples than unknowns: as far as what they tell of directions is
chance, their scatter is taken to be even, in the metric of the matrix.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Points, Transforms
from idem_ros.core.geometry import se3
from idem_ros.core.metric.measured_points import usual
from idem_ros.core.several.joint_balls import JointBalls
from idem_ros.core.several.regions import pulls_of, regions_at, stiffness_along
from idem_ros.core.several.system import JointSystem, about_middles, moved
from idem_ros.core.trust.covariance import FLOOR, LEVERAGE
from idem_ros.core.trust.curvature import LEAST_CURVATURE, MOST_CURVATURE, STEP
from idem_ros.core.trust.regions import REGION
from idem_ros.core.trust_tuning import TrustTuning

PROBES = 5
LEAST_REGION = 5.0  # of the radius: balls of several clouds have more members in common
SAMPLE = 8000  # centres, about, that the curvature is taken from

if TYPE_CHECKING:
    from idem_ros.core.several.joint_descent import JointCost


class _Sample(NamedTuple):
    """What the regions would move the poses by: G samples of their error."""

    moves: Floats  # (6 F, G): of the free clouds, by each region without which the rest would be
    gram: Floats  # (G, G): their products by the matrix

    @property
    def scatter(self) -> float:
        """The sum of their squares."""
        return float(np.trace(self.gram))

    @property
    def chance(self) -> float:
        """How much of what the samples tell of directions is chance, 0 to 1: Ledoit and Wolf's.

        The intensity to shrink to the matrix's own inverse by: of fewer samples than unknowns
        some motions would seem to have no error at all.
        """
        count, size = len(self.gram), len(self.moves)
        squares = float((self.gram**2).sum())
        spread = squares - self.scatter**2 / size
        if spread <= 0.0:
            return 1.0
        noise = float((np.diag(self.gram) ** 2).sum()) - squares / count
        return float(np.clip(noise / spread, 0.0, 1.0))


def nat_at(cost: 'JointCost', poses: Transforms) -> float:
    """Return what of a nat of q_tot is information: by how the pulls of regions scatter.

    The covariance of poses is then about the inverse of this times the matrix: so q_tot and
    priors, whose covariance is known, can be added.
    """
    system = cost.system(poses, with_priors=False)
    scatter = _sample(cost, poses, system).scatter
    return len(system.gradient) / scatter if scatter > 0.0 else 1.0


def joint_covariance(cost: 'JointCost', poses: Transforms, trust: TrustTuning) -> Floats:
    """Return the covariance (6 K, 6 K) of the poses of the clouds' frames.

    x y z rx ry rz of each, in the common frame's axes, about the frame's own origin; zero for
    what is held.
    """
    system = cost.system(poses)
    if len(system.free) == 0:
        return np.zeros((6 * len(poses), 6 * len(poses)))
    of_points = cost.system(poses, with_priors=False).matrix if cost.known.priors else None
    sample = _sample(cost, poses, system)
    moves, chance = sample.moves, sample.chance
    even = sample.scatter / len(moves) * _propagated(system, of_points)
    found = (1.0 - chance) * moves @ moves.T + chance * even
    found *= (
        trust.alike
        * (1.0 if cost.balls.among_voxels else trust.jumps)
        / _curvature(cost, poses, system, moves) ** 2
    )
    if of_points is not None:
        found += _propagated(system, (system.matrix - of_points) / cost.nat)
    found += np.diag(np.tile(_floor(cost.balls), len(system.free)))
    return _of_frames(found, system, poses, cost.known.origins)


def _propagated(system: JointSystem, matrix: Any) -> Floats:
    """Return H^-1 M H^-1 of a sparse matrix M (6 F, 6 F); None: of H itself."""
    if matrix is None:
        return system.solved(np.eye(len(system.gradient)))
    return system.solved(system.solved(matrix.toarray()).T)


def _sample(cost: 'JointCost', poses: Transforms, system: JointSystem) -> _Sample:
    """Return the jackknife's `_Sample`: how far the rest would move without each region.

    That is the region's own pull over what the matrix is without it, along where it pulls.
    """
    balls = cost.balls
    edge = max(REGION * lever_arm(balls), LEAST_REGION * balls.radius)
    regions = regions_at(balls, cost.ball_cost, poses, edge)
    pulls = pulls_of(regions)
    some = np.flatnonzero(pulls.any(axis=(1, 2)))
    gradients = _of_free(pulls[some], poses, system)
    moves = system.solved(gradients)
    twists = np.zeros_like(pulls)
    about = about_middles(poses)
    alone = moves.T.reshape(len(some), len(system.free), 6)
    twists[np.ix_(some, system.free)] = np.einsum('kij,gkj->gki', about[system.free], alone)
    along = np.einsum('ig,ig->g', moves, gradients)
    share = stiffness_along(regions, twists)[some] / np.maximum(along, 1e-300)
    rest = 1.0 - LEVERAGE * np.clip(share, 0.0, 1.0)
    return _Sample(moves / rest, (moves / rest).T @ (gradients / rest))


def _curvature(cost: 'JointCost', poses: Transforms, system: JointSystem, moves: Floats) -> float:
    """Return what the curvature is of the majoriser's, along the errors that are likely.

    Along sums of the regions' moves (6 F, G) with random signs, each as far as the solver's balls
    still hold most of their members.
    """
    rng, parts = np.random.default_rng(0), list[float]()
    sample = cost.sampled(SAMPLE)
    of_sample = sample.system(poses)
    if len(of_sample.free) == len(system.free):
        cost, system = sample, of_sample
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
    lengths = [np.linalg.norm(usual(part), axis=1) for part in np.split(balls.points, ends)]
    squares = [float(part @ part) / len(part) for part in lengths]
    return max(float(np.sqrt(np.median(squares))), balls.radius)


def _of_free(pulls: Floats, poses: Transforms, system: JointSystem) -> Floats:
    """Return gradients (G, K, 6) about the origin as (6 F, G), about the free clouds' middles."""
    about = np.einsum('kji,gkj->gki', about_middles(poses), pulls)[:, system.free]
    return np.ascontiguousarray(about.reshape(len(pulls), 6 * len(system.free)).T)


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
