"""How far a result may be from the truth: a sandwich, curvature about the scatter of the pull.

At the minimum the pulls of all balls cancel. How much the rest would pull without those of one
region, and how far that would move the result, is a sample of its error: the jackknife. Regions
are wide, because neighbours err alike: they share points, rings of a scan and the flaws of a wall.
A part comes from regions twice as wide: what errs alike over more of the scene, few regions tell.
"""

import numpy as np
from numba import njit

from idem_ros.core import se3
from idem_ros.core.jit import JIT
from idem_ros.core.linearization import IN_ONE, SUMS, linearize, of_both
from idem_ros.core.solver import LEAST_STIFFNESS

# Edge of the cubes that err together: of the arm, and of the radius at least.
REGION, LEAST_REGION = 0.27, 3.0
SHARES = (0.9, 0.1)  # of the regions, and of those twice as wide, in the variance
# Single points enter balls and leave them: the minimum jumps by more than the pulls there tell.
JUMPS = 1.1  # of the variance, where points are as given
PERIOD = 8  # regions along each axis, after which they repeat: a power of two
SAMPLE = 160  # centres of each cloud, about, that the curvature is taken from
STEP = 0.02  # of the radius: between gradients; within the pairs' skin far beyond the arm, too
LEAST_CURVATURE, MOST_CURVATURE = 0.2, 1.5  # of the majoriser's
LEVERAGE = 0.95  # most of a motion's hold that one region may have: it leaves a finite variance
FLOOR = 1e-4  # of the radius: where the solver stops


def by_region(joint, T_target_source, hold):
    """Return gradients (G, 6) and Gauss-Newton matrices (G, 6, 6) of the regions, x fastest."""
    pairs = joint.pairs_at(T_target_source)
    edge = max(REGION * hold.arm, LEAST_REGION * joint.radius)
    return _by_region(joint, pairs, T_target_source, edge)


def covariance_of(joint, T_target_source, hold, pulls, stiffness):
    """Return the (6, 6) covariance of a result's error, a twist (omega, v) on its left.

    Args:
        joint: the `JointEntropy` that was minimised.
        T_target_source: (4, 4) where.
        hold: its `Hold` there; along free motions the deviation is as far as the surfaces reach,
            or 1 rad: more would leak into what is held, for the axes are not known exactly.
        pulls, stiffness: `by_region` there.
    """
    held, free = _firm_and_loose(hold, stiffness.sum(axis=0))
    part, axes = _curvature(joint, T_target_source, held, hold)
    # In these motions the whole stiffness, and then the curvature, are the identity.
    firm = held @ axes
    roots = firm / np.sqrt(part)
    scatter = SHARES[0] * _scatter(pulls, stiffness, firm, roots)
    scatter += SHARES[1] * _scatter(_wider(pulls), _wider(stiffness), firm, roots)
    if not (len(joint.target.raw) and len(joint.source.raw)):
        scatter *= JUMPS
    units = hold.motions[:, ~hold.free]
    floor = (FLOOR * joint.radius) ** 2 * units @ units.T
    return scatter + floor + hold.arm**2 * free @ free.T


def _scatter(pulls, stiffness, firm, roots):
    """Return the jackknife's (6, 6): the sum over regions of how far the rest would move."""
    some = stiffness[:, 3, 3] > 0.0
    rest = np.eye(firm.shape[1]) - LEVERAGE * (firm.T @ stiffness[some] @ firm)
    moves = np.linalg.solve(rest, (pulls[some] @ roots)[:, :, None])[:, :, 0] @ roots.T
    return moves.T @ moves


def _wider(of_regions):
    """Sum over cubes of eight regions: PERIOD is even, so that they repeat with it."""
    shape = of_regions.shape[1:]
    return of_regions.reshape(3 * (PERIOD // 2, 2) + shape).sum(axis=(1, 3, 5)).reshape(-1, *shape)


def _firm_and_loose(hold, matrix):
    """Return motions (6, k) of unit stiffness, and the others: those free, and without any."""
    held, free = hold.motions[:, ~hold.free], hold.motions[:, hold.free]
    stiffness, axes = np.linalg.eigh(held.T @ matrix @ held)
    firm = stiffness > LEAST_STIFFNESS * stiffness.max(initial=0.0)
    loose = np.concatenate([free, held @ axes[:, ~firm]], axis=1)
    return held @ axes[:, firm] / np.sqrt(stiffness[firm]), loose


def _curvature(joint, T, held, hold):
    """Return the curvature over the majoriser's along axes (k, k) of the held motions, (k,).

    The majoriser is wider than the cost: by how much, a sample of the centres tells.
    """
    moved = np.linalg.norm(np.linalg.solve(hold.units, held), axis=0)
    steps = STEP * joint.radius / moved
    pairs = joint.pairs_at(T)
    stride = max(min(len(joint.target.order), len(joint.source.order)) // SAMPLE, 1)
    pull, stiffness = _by_region(joint, pairs, T, None, stride)
    change = [
        (_by_region(joint, pairs, se3.exp(step * motion) @ T, None, stride)[0] - pull)[0] / step
        for step, motion in zip(steps, held.T, strict=True)
    ]
    sampled = held.T @ stiffness[0] @ held
    if np.linalg.matrix_rank(sampled) < len(sampled):  # it met no surface that holds them all
        return np.ones(len(sampled)), np.eye(len(sampled))
    found = np.linalg.solve(sampled, np.array(change).reshape(-1, 6) @ held)
    part, axes = np.linalg.eigh((found + found.T) / 2)
    return np.clip(part, LEAST_CURVATURE, MOST_CURVATURE), axes


def _by_region(joint, pairs, T, region, stride=1):
    """Return gradient (G, 6) and Gauss-Newton matrix (G, 6, 6) of each region, zeros for none.

    region: edge; None: all is one.
    """
    here, there = np.zeros((2, 1, 1 if region is None else PERIOD**3, SUMS))
    back = se3.inverse(T)
    groups = _groups(joint, T, region)
    _sum(joint, (joint.target, joint.source), pairs.of_target, T, groups[0], stride, here[0])
    _sum(joint, (joint.source, joint.target), pairs.of_source, back, groups[1], stride, there[0])
    return of_both(here, there, back)


def _groups(joint, T, region):
    """Return the number of each centre's region, of the target's and of the source's."""
    if region is None:
        return IN_ONE, IN_ONE
    here = _group(joint.target.grid.points, np.eye(4), region)
    return here, _group(joint.source.grid.points, np.ascontiguousarray(T), region)


@njit(**JIT)
def _group(points, T, region):
    group, of_region = np.empty(points.shape[0], np.int64), 1.0 / region
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        number = 0
        for axis in range(2, -1, -1):
            place = T[axis, 0] * x + T[axis, 1] * y + T[axis, 2] * z + T[axis, 3]
            number = PERIOD * number + (np.int64(np.floor(place * of_region)) & (PERIOD - 1))
        group[i] = number
    return group


def _sum(joint, clouds, candidates, T, group, stride, sums):
    """Add the linearisation around every stride-th centre to the row of its group."""
    centres, others = clouds
    R, t = np.ascontiguousarray(T[:3, :3]), T[:3, 3].copy()
    around = (others.grid.points, others.raw, *candidates, R, t)
    chosen = (0, len(centres.order), stride)
    linearize(centres.grid.points, centres.raw_own, *around, *joint.size, chosen, group, sums)
