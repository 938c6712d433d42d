"""How much worse the clouds agree a radius away from a pose, along each motion that is held."""

import numpy as np
from numba import njit

from idem_ros.core import se3
from idem_ros.core.grid import neighbours, room_for
from idem_ros.core.jit import JIT
from idem_ros.core.moments import (
    entropy,
    into_frame,
    plus,
    rotated,
    row_of,
    unit_moments,
)

SAMPLE = 128  # centres of each cloud, about


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
    places = [T_target_source]
    for motion in joint.radius * motions.T:
        places += [se3.exp(motion) @ T_target_source, se3.exp(-motion) @ T_target_source]
    q, within = sums_at_each(joint, np.array(places), chosen, sample)
    return (q[1:] - q[0]) / within[0] if within[0] else np.zeros(len(q) - 1)


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
    sides = ((joint.target, joint.source), (joint.source, joint.target))
    backs = se3.inverses(np.ascontiguousarray(transforms))
    q, within = np.zeros((2, len(transforms)))
    for (centres, others), at, some in zip(sides, (transforms, backs), chosen, strict=True):
        some = some[:: max(len(some) // sample, 1)]
        own = (centres.grid.points, centres.unit_own)
        R, t = np.ascontiguousarray(at[:, :3, :3]), np.ascontiguousarray(at[:, :3, 3])
        _sum_at_each(*own, some, others.grid, R, t, joint.r2, joint.radius, q, within)
    return q, within


@njit(**JIT)
def _sum_at_each(centres, own, chosen, grid, R, t, r2, scale, q, within):
    """Add q_i (Eq. 7) of those in reach at the first transform to q (K,), and 1 to within."""
    found, rows = room_for(grid)
    for i in chosen:
        alone = row_of(own, i)
        h = entropy(alone, scale)
        for k in range(q.shape[0]):
            x, y, z = into_frame(centres[i], R[k], t[k])
            n = neighbours(x, y, z, grid, r2, found, rows)
            if n == 0:
                if k == 0:
                    break
                continue
            m = unit_moments(x, y, z, grid.points, found, 0, n, r2)
            q[k] += entropy(plus(alone, rotated(R[k], m)), scale) - h
            within[k] += 1.0
