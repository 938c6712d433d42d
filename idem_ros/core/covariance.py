"""How far a result may be from the truth: a sandwich, curvature about the scatter of the pull.

At the minimum the pulls of all balls cancel. How much the rest would pull without those of one
region, and how far that would move the result, is a sample of its error: the jackknife. Regions
are wide, because neighbours err alike: they share points, rings of a scan and the flaws of a wall.
A part comes from regions twice as wide: what errs alike over more of the scene, few regions tell.
"""

import numpy as np

from idem_ros.core import se3
from idem_ros.core.jit import kernel
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
    edge = max(REGION * hold.arm, LEAST_REGION * joint.radius)
    here = _group(joint.target.grid.points, np.eye(4), edge)
    there = _group(joint.source.grid.points, np.ascontiguousarray(T_target_source), edge)
    in_turn = [_in_turn(group) for group in (here, there)]
    pairs = joint.pairs_at(T_target_source)
    return _linearized(joint, pairs, T_target_source, in_turn, (here, there))


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
    small, wide = np.sqrt(SHARES)
    pulls = np.concatenate([small * pulls, wide * _wider(pulls)])
    scatter = _scatter(pulls, np.concatenate([stiffness, _wider(stiffness)]), firm, roots)
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
    sums = _sums_of_cubes(of_regions.reshape(PERIOD**3, -1))
    return sums.reshape(-1, *of_regions.shape[1:])


@kernel
def _sums_of_cubes(of_regions):
    half = PERIOD // 2
    sums = np.zeros((half**3, of_regions.shape[1]))
    for g in range(of_regions.shape[0]):
        x, y, z = g % PERIOD // 2, g // PERIOD % PERIOD // 2, g // PERIOD**2 // 2
        for c in range(of_regions.shape[1]):
            sums[(z * half + y) * half + x, c] += of_regions[g, c]
    return sums


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
    sizes = [len(side.order) for side in (joint.target, joint.source)]
    some = [np.arange(0, size, max(min(sizes) // SAMPLE, 1)) for size in sizes]
    places = np.array([T, *(se3.exp(move) @ T for move in (steps * held).T)])
    (pull, *others), (stiffness, *_) = _at_each(joint, pairs, places, some)
    change = (np.reshape(others, (-1, 6)) - pull) / steps[:, None]
    sampled = held.T @ stiffness @ held
    firmness = np.linalg.eigvalsh(sampled)
    if (firmness <= LEAST_STIFFNESS * firmness.max(initial=0.0)).any():  # it met not all surfaces
        return np.ones(len(sampled)), np.eye(len(sampled))
    found = np.linalg.solve(sampled, change @ held)
    part, axes = np.linalg.eigh((found + found.T) / 2)
    return np.clip(part, LEAST_CURVATURE, MOST_CURVATURE), axes


def _linearized(joint, pairs, T, chosen, groups):
    """Return gradients (G, 6) and Gauss-Newton matrices (G, 6, 6) of groups of centres.

    chosen: indices of the target's centres, and of the source's; groups: which one each is in.
    """
    here, there = np.zeros((2, 1, PERIOD**3, SUMS))
    sides = _sides(joint, pairs, T[None])
    for (around, R, t), *what in zip(sides, chosen, groups, (here[0], there[0]), strict=True):
        linearize(*around, R[0], t[0], *joint.size, *what)
    return of_both(here, there, se3.inverse(T))


def _at_each(joint, pairs, transforms, chosen):
    """Return gradients (K, 6) and Gauss-Newton matrices (K, 6, 6) of some centres, at each."""
    here, there = np.zeros((2, len(transforms), 1, SUMS))
    sides = _sides(joint, pairs, transforms)
    for (around, R, t), some, sums in zip(sides, chosen, (here, there), strict=True):
        _linearize_at_each(*around, R, t, joint.size, some, sums)
    return _of_each(here, there, se3.inverses(transforms))


def _sides(joint, pairs, transforms):
    """Return what `linearize` takes before and in place of R and t, of target and source."""
    sides = (
        (joint.target, joint.source, pairs.of_target, transforms),
        (joint.source, joint.target, pairs.of_source, se3.inverses(transforms)),
    )
    return [
        (
            (own.grid.points, own.raw_own, others.grid.points, others.raw, *candidates),
            np.ascontiguousarray(at[:, :3, :3]),
            np.ascontiguousarray(at[:, :3, 3]),
        )
        for own, others, candidates, at in sides
    ]


@kernel
def _linearize_at_each(centres, own, points, raw, first, member, R, t, size, chosen, sums):
    for k in range(R.shape[0]):
        around = (centres, own, points, raw, first, member, R[k], t[k])
        linearize(*around, *size, chosen, IN_ONE, sums[k])


@kernel
def _of_each(here, there, backs):
    pulls, stiffness = np.empty((backs.shape[0], 6)), np.empty((backs.shape[0], 6, 6))
    for k in range(backs.shape[0]):
        pull, matrix = of_both(here[k : k + 1], there[k : k + 1], backs[k])
        pulls[k], stiffness[k] = pull[0], matrix[0]
    return pulls, stiffness


@kernel
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


@kernel
def _in_turn(group):
    """Return the indices of centres, one group's after another's."""
    start, order = np.zeros(PERIOD**3 + 1, np.int64), np.empty(group.shape[0], np.int64)
    for g in group:
        start[g + 1] += 1
    for g in range(PERIOD**3):
        start[g + 1] += start[g]
    for i in range(group.shape[0]):
        order[start[group[i]]] = i
        start[group[i]] += 1
    return order
