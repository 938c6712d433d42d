"""How much worse the clouds agree a radius away from a pose, along each motion that is held."""

import numpy as np

from idem_ros.core import se3
from idem_ros.core.grid import neighbours, room_for
from idem_ros.core.jit import kernel
from idem_ros.core.moments import (
    entropy,
    into_frame,
    plus,
    rotated,
    row_of,
    unit_moments,
)

SAMPLE = 128  # centres of each cloud, about
NOTHING = np.empty(0)


def contrasts(joint, T_target_source, motions, chosen, sample):
    """Return (2 k,): by how much q_mean is higher a radius to either side of a pose.

    Of those of the chosen that have a neighbour in the other cloud at the pose; 0 where none has.

    Args:
        joint: a `JointEntropy`.
        T_target_source: (4, 4) pose, between the clouds' origins.
        motions: (6, k) twists (omega, v) that move the surfaces by about 1.
        chosen: indices of centres of the target, and of the source.
        sample: how many of each, about, are taken.
    """
    places = _around(T_target_source, joint.radius * motions)
    q, within = sums_at_each(joint, places, chosen, sample)
    return (q[1:] - q[0]) / within[0] if within[0] else np.zeros(len(q) - 1)


def contrasts_of_each(joint, T_target_source, motions, holders, differences, sample):
    """Return (k, 2): the same of each motion, of centres of its own that have a neighbour.

    Args:
        holders: for each motion, indices of such centres of the target, and of the source.
        differences: q_i at the pose, lengths over the radius, of the target's points and of the
            source's.
    """
    places = [_around(T_target_source, joint.radius * motion[:, None])[1:] for motion in motions.T]
    chosen = [[_sampled(some, sample) for some in pair] for pair in holders]
    orders = joint.target.order, joint.source.order
    there = [q[order] for q, order in zip(differences, orders, strict=True)]
    rises, _ = _sums(joint, np.array(places), chosen, there)
    count = np.array([sum(map(len, pair)) for pair in chosen])
    return rises / np.maximum(count, 1)[:, None]


def _around(T, motions):
    """Return (2 k + 1, 4, 4): a pose, and those after each of (6, k) motions, forth and back."""
    places = [T]
    for motion in motions.T:
        places += [se3.exp(motion) @ T, se3.exp(-motion) @ T]
    return np.array(places)


def sums_at_each(joint, transforms, chosen, sample=SAMPLE):
    """Return the sum of q_i (K,) at transforms (K, 4, 4), and of how many points each is (K,).

    Lengths are over the radius, whatever the entropy that is minimised takes them over.

    Of those in reach at the first transform; a point out of reach at another counts 0 there.

    Args:
        joint: a `JointEntropy`.
        transforms: (K, 4, 4), between the clouds' origins.
        chosen: indices of centres of the target, and of the source.
        sample: how many of each, about, are taken.
    """
    chosen = [_sampled(some, sample) for some in chosen]
    q, within = _sums(joint, transforms[None], [chosen])
    return q[0], within[0]


def _sampled(some, sample):
    return some[:: max(round(len(some) / sample), 1)]


def _sums(joint, transforms, chosen, less=(NOTHING, NOTHING)):
    """Return the same (G, K) for groups of transforms (G, K, 4, 4), each with its own centres.

    less: what is taken off the q_i of each of the target's centres, and of the source's; the
        chosen are then taken to be in reach. Nothing: only those in reach at the first transform.
    """
    groups, count = transforms.shape[:2]
    flat = np.ascontiguousarray(transforms).reshape(-1, 4, 4)
    sides = ((joint.target, joint.source, flat), (joint.source, joint.target, se3.inverses(flat)))
    q, within = np.zeros((2, groups, count))
    for (centres, others, at), some, off in zip(
        sides, zip(*chosen, strict=True), less, strict=True
    ):
        ends = np.cumsum([0, *map(len, some)])
        own = (centres.grid.points, centres.unit_own)
        R = at[:, :3, :3].reshape(groups, count, 3, 3)
        t = at[:, :3, 3].reshape(groups, count, 3)
        what = (joint.r2, joint.radius, off, q, within)
        _sum_at_each(*own, np.concatenate(some), ends, others.grid, R, t, *what)
    return q, within


@kernel
def _sum_at_each(centres, own, chosen, ends, grid, R, t, r2, scale, less, q, within):
    """Add q_i (Eq. 7) at each of a group's transforms to q, and 1 to within."""
    found, rows = room_for(grid)
    for g in range(q.shape[0]):
        for i in chosen[ends[g] : ends[g + 1]]:
            alone = row_of(own, i)
            h = entropy(alone, scale)
            for k in range(q.shape[1]):
                x, y, z = into_frame(centres[i], R[g, k], t[g, k])
                n = neighbours(x, y, z, grid, r2, found, rows)
                if less.shape[0] > 0:
                    q[g, k] -= less[i]
                if n == 0:
                    if less.shape[0] == 0 and k == 0:
                        break
                    continue
                m = unit_moments(x, y, z, grid.points, found, 0, n, r2)
                q[g, k] += entropy(plus(alone, rotated(R[g, k], m)), scale) - h
                within[g, k] += 1.0
