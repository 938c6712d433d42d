"""How far a result may be from the truth: a sandwich, curvature about the scatter of the pull.

At the minimum the pulls of all balls cancel. How much the rest would pull without those of one
region, and how far that would move the result, is a sample of its error: the jackknife. Regions
are wide, because neighbours err alike: they share points, rings of a scan and the flaws of a wall.
"""

import numpy as np

from idem_ros.core import se3
from idem_ros.core.linearization import IN_ONE, SUMS, linearize, unpack
from idem_ros.core.solver import LEAST_STIFFNESS

# Edge of the cubes that err together: of the arm, and of the radius at least.
REGION, LEAST_REGION = 1 / 3, 3.0
PERIOD = 16  # regions along each axis, after which they repeat
SAMPLE = 256  # centres of each cloud, about, that the curvature is taken from
STEP = 0.02  # of the radius: between gradients; within the pairs' skin far beyond the arm, too
LEAST_CURVATURE, MOST_CURVATURE = 0.2, 1.5  # of the majoriser's
LEVERAGE = 0.95  # most of a motion's hold that one region may have: it leaves a finite variance
FREE_VARIANCE = 1e6  # of a motion that nothing holds, in the clouds' unit squared
FLOOR = 1e-4  # of the radius: where the solver stops


def by_region(joint, T_target_source, hold):
    """Return gradients (G, 6) and Gauss-Newton matrices (G, 6, 6) of the regions that have any."""
    pairs = joint.pairs_at(T_target_source)
    edge = max(REGION * hold.arm, LEAST_REGION * joint.radius)
    return _by_region(joint, pairs, T_target_source, edge)


def covariance_of(joint, T_target_source, hold, pulls, stiffness):
    """Return the (6, 6) covariance of a result's error, a twist (omega, v) on its left.

    Args:
        joint: the `JointEntropy` that was minimised.
        T_target_source: (4, 4) where.
        hold: its `Hold` there; along free motions the variance is FREE_VARIANCE, never infinite.
        pulls, stiffness: `by_region` there.
    """
    pairs = joint.pairs_at(T_target_source)
    held, free = _firm_and_loose(hold, stiffness.sum(axis=0))
    if held.shape[1] == 0:
        return FREE_VARIANCE * free @ free.T
    pulls, stiffness = pulls @ held, held.T @ stiffness @ held
    whole = stiffness.sum(axis=0)
    curvature = _curvature(joint, pairs, T_target_source, held, whole)
    # Without a region, what is left has this curvature, and the pull that the region balanced.
    share = LEVERAGE * np.trace(curvature) / np.trace(whole)
    moves = np.linalg.solve(curvature - share * stiffness, pulls[:, :, None])[:, :, 0]
    spread = moves.T @ moves + (FLOOR * joint.radius) ** 2 * np.eye(held.shape[1])
    return held @ spread @ held.T + FREE_VARIANCE * free @ free.T


def _firm_and_loose(hold, matrix):
    """Return motions (6, k) with a stiffness, and the others: the free ones and what has none."""
    held, free = hold.motions[:, ~hold.free], hold.motions[:, hold.free]
    stiffness, axes = np.linalg.eigh(held.T @ matrix @ held)
    firm = stiffness > LEAST_STIFFNESS * stiffness.max(initial=0.0)
    return held @ axes[:, firm], np.concatenate([free, held @ axes[:, ~firm]], axis=1)


def _curvature(joint, pairs, T, held, whole):
    """Return the change of the gradient along the held motions, (k, k), symmetric and positive.

    The majoriser `whole` is wider than the cost: by how much, a sample of the centres tells.
    """
    step = STEP * joint.radius
    stride = max(min(len(joint.target.order), len(joint.source.order)) // SAMPLE, 1)
    pull, stiffness = _by_region(joint, pairs, T, None, stride)
    change = []
    for motion in held.T:
        moved, _ = _by_region(joint, pairs, se3.exp(step * motion) @ T, None, stride)
        change.append(held.T @ (moved - pull)[0] / step)
    root = np.linalg.cholesky(whole)
    found = whole @ np.linalg.solve(held.T @ stiffness[0] @ held, np.array(change))
    part, axes = np.linalg.eigh(
        np.linalg.solve(root, np.linalg.solve(root, found + found.T).T) / 2
    )
    axes = root @ axes
    return axes * np.clip(part, LEAST_CURVATURE, MOST_CURVATURE) @ axes.T


def _by_region(joint, pairs, T, region, stride=1):
    """Return gradient (G, 6) and Gauss-Newton matrix (G, 6, 6) of each region that has any.

    region: edge; None: all is one.
    """
    here, there = np.zeros((2, 1 if region is None else PERIOD**3, SUMS))
    back = se3.inverse(T)
    at_home = joint.target.grid.points
    _sum(joint, (joint.target, joint.source), pairs.of_target, T, at_home, region, stride, here)
    moved = se3.transform_points(T, joint.source.grid.points)
    _sum(joint, (joint.source, joint.target), pairs.of_source, back, moved, region, stride, there)
    chosen = here.any(axis=1) | there.any(axis=1)
    to_source = se3.adjoint(back)
    (pulls, stiffness), (pulls_there, stiffness_there) = map(unpack, (here[chosen], there[chosen]))
    return pulls - pulls_there @ to_source, stiffness + to_source.T @ stiffness_there @ to_source


def _sum(joint, clouds, candidates, T, places, region, stride, sums):
    """Add each region's linearisation to its row; places: the centres in the target's frame."""
    (centres, others), group = clouds, IN_ONE
    if region is not None:
        cell = np.floor(places / region).astype(np.int64) % PERIOD
        group = cell @ (1, PERIOD, PERIOD**2)
    R, t = np.ascontiguousarray(T[:3, :3]), T[:3, 3].copy()
    around = (others.grid.points, others.raw, *candidates, R, t)
    size = (joint.r2, joint.scale, joint.noise, joint.slide)
    chosen = (0, len(centres.order), stride)
    linearize(centres.grid.points, centres.raw_own, *around, *size, chosen, group, sums)
