"""What a refinement looks like: the source where it was put, and each point's share of q_tot."""

import numpy as np

from idem_ros.core import q_per_point
from idem_ros.core.geometry.se3 import transform_points


def points_of(cloud):
    """Return the points (N, 3) of a `Cloud` in its own frame."""
    return cloud.points + cloud.origin


def aligned_points(T_target_source, source):
    """Return the points (N, 3) of a `Cloud` in the target frame."""
    return transform_points(T_target_source, points_of(source))


def points_with_q(result, target, source, config):
    """Return the points of both clouds in the target frame, with what each adds to q_tot.

    Args:
        result: `RegistrationResult` of the two.
        target, source: `Cloud`s that took part.
        config: `RegistrationConfig` of the result; where it has a `voxel_size` the points are
            the voxel means, which q_tot is of.

    Returns:
        points (N + M, 3), q_i (N + M,) [nat] and (N + M,): 0 of the target, 1 of the source.
    """
    if (size := result.voxel_size) is not None:
        target, source = target.reduced(size), source.reduced(size)
    T = result.T_target_source
    points = np.concatenate([target.points + target.origin, aligned_points(T, source)])
    cloud = np.repeat([0.0, 1.0], [len(target), len(source)])
    if not result.radius > 0.0:  # too few points, or all in one place: nothing was evaluated
        return points, np.zeros(len(points)), cloud
    given = {'radius': result.radius, 'length_scale': config.length_scale}
    q = [
        each if len(each) == len(of) else each[of.finite]
        for each, of in zip(q_per_point(target, source, T, **given), (target, source), strict=True)
    ]
    return points, np.concatenate(q), cloud
