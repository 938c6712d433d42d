"""Register two clouds by minimising q_tot: the algorithm on one page."""

import itertools
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

import numpy as np

from idem_ros.core import se3
from idem_ros.core.blocks import in_threads
from idem_ros.core.cloud import Cloud, as_cloud, neighbourhoods
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.constraint import hold_of
from idem_ros.core.joint_entropy import (
    JointEntropy,
    between_origins,
    from_origins,
    length_unit,
)
from idem_ros.core.metric import overlap_of
from idem_ros.core.noise import widening
from idem_ros.core.radii import rounded, stage_radii, widest_useful
from idem_ros.core.solver import Solution, minimize_on_se3

EASE = 50.0  # of the tolerances before the last stage, which need only reach the next one's basin
CROWDED = 250.0  # points in a cell: from here on their voxels are as good, and much faster
FINE = 0.25  # of the radius
SPACING = 0.6  # of a stage's radius: voxels of points as given; their balls hold ten or so
ROS_ORDER = [3, 4, 5, 0, 1, 2]  # of (omega, v): translation first
LEAST_POINTS = 5  # a point and its four neighbours


class Status(Enum):
    """How a registration ended."""

    CONVERGED = 'converged'
    MAX_ITERATIONS = 'max_iterations'
    NO_OVERLAP = 'no_overlap'
    DEGENERATE = 'degenerate'
    TOO_FEW_POINTS = 'too_few_points'


@dataclass(frozen=True)
class RegistrationResult:
    """The refined transform, and how well the clouds agree there."""

    T_target_source: np.ndarray  # (4, 4): p_target = R p_source + t
    status: Status
    iterations: int  # steps over all stages
    q_tot: float  # of the registered clouds (voxel means where voxel_size is given) [nat]
    q_mean: float  # q_tot per point that has a neighbour in the other cloud [nat]
    overlap: float  # fraction of the points that have one, of both clouds
    radius: float  # search radius of the last stage, in the clouds' unit
    information: np.ndarray  # (6, 6), x y z rx ry rz: a motion of the source in the target frame
    # (k, 6), likewise: motions that no surface holds
    free_motions: np.ndarray = field(default_factory=lambda: np.empty((0, 6)))

    @property
    def converged(self):
        """Whether the last stage ended in a point where no step moves the source."""
        return self.status is Status.CONVERGED


def register(target, source, T_target_source=None, config=None):
    """Refine the pose of the source in the target frame by minimising q_tot.

    Args:
        target: (N, 3) points or a `Cloud`, in the target frame.
        source: (M, 3) points or a `Cloud`, in the source frame.
        T_target_source: (4, 4) initial guess; None: identity.
        config: `RegistrationConfig`; None: its defaults.

    Returns:
        A `RegistrationResult`; whether it converged is a value, not an exception.

    Raises:
        InvalidCloud, InvalidTransform: for input that is no cloud or no rigid transform.
    """
    config = RegistrationConfig() if config is None else config
    is_ours = [not isinstance(points, Cloud) for points in (target, source)]
    target, source = in_threads(config.threads, as_cloud, (target, source))
    T = np.eye(4) if T_target_source is None else se3.checked_transform(T_target_source)
    finest = [target, source]
    if config.voxel_size is not None:
        finest = _reduced(finest, config.voxel_size, config.threads)
    if min(len(cloud) for cloud in finest) < LEAST_POINTS:
        return _without_solution(T, Status.TOO_FEW_POINTS)
    radii = stage_radii(*finest, config)  # Eq. 9
    if radii[-1] == 0.0:
        return _without_solution(T, Status.DEGENERATE)
    if config.voxel_size is None:
        finest = [_uncrowded(cloud, radii[-1]) for cloud in finest]
    radii[-1] = _widened(*finest, radii[-1], config)
    finest, T = tuple(finest), between_origins(target, source, T)
    descent = _descend(finest, is_ours, radii, T, config)
    hold = hold_of(descent.joint, descent.solution.transform)
    if config.free_motions == 'guess' and hold.free.any():
        motions = hold.motions[:, ~hold.free]
        descent = _descend(finest, is_ours, radii, T, config, motions, descent.iterations)
    return _result(target, source, descent, hold)


class _Descent(NamedTuple):
    joint: JointEntropy  # of the last stage
    solution: Solution
    iterations: int


def _descend(finest, is_ours, radii, T, config, motions=None, iterations=0):
    """Minimise from T through the stages; motions (6, k): those allowed."""
    widest = widest_useful(*finest)
    for stage, (radius, factor) in enumerate(zip(radii, config.radius_schedule, strict=True), 1):
        last = stage == len(radii)
        if radius > widest and not last:
            continue
        spacing = SPACING * radius if config.voxel_size is None else factor * config.voxel_size
        clouds = finest if factor <= 1.0 else _reduced(finest, spacing, config.threads)
        joint = JointEntropy(
            *clouds, radius, config.length_scale, threads=config.threads, slide=last
        )
        termination = _termination(config, radius, last)
        solution = minimize_on_se3(joint.linearize, T, **termination, motions=motions)
        T, iterations = solution.transform, iterations + solution.iterations
        for cloud in itertools.compress(finest, is_ours):
            cloud.forget_reduced()
    return _Descent(joint, solution, iterations)


def _reduced(clouds, voxel_size, threads):
    return in_threads(threads, lambda cloud: cloud.reduced(voxel_size), clouds)


def _widened(target, source, radius, config):
    scale = length_unit(config.length_scale, radius)
    neighbourhoods([target, source], radius, scale, config.threads)
    wider = rounded(radius * widening(target, source, radius, scale))
    if wider != radius:
        target.forget(radius, scale)
        source.forget(radius, scale)
    return wider


def _uncrowded(cloud, radius):
    """Reduce a cloud of which a ball would hold hundreds of points: copies, or far denser."""
    return cloud if cloud.crowding(radius) <= CROWDED else cloud.reduced(FINE * radius)


def _termination(config, radius, last):
    ease = 1.0 if last else EASE
    return {
        'max_iterations': config.max_iterations,
        'rotation_tolerance': ease * config.rotation_tolerance,
        'distance_tolerance': ease * config.translation_tolerance * radius,
    }


def _result(target, source, descent, hold):
    joint, solution, iterations = descent
    (q_target, reach_target), (q_source, reach_source) = joint.per_point(solution.transform)
    q = float(q_target.sum() + q_source.sum())
    within, overlap = overlap_of(reach_target, reach_source)
    if within == 0:
        status = Status.NO_OVERLAP
    elif solution.free or hold.free.any():
        status = Status.DEGENERATE
    else:
        status = Status.CONVERGED if solution.converged else Status.MAX_ITERATIONS
    return RegistrationResult(
        T_target_source=from_origins(target, source, solution.transform),
        status=status,
        iterations=iterations,
        q_tot=q,
        q_mean=q / within if within else 0.0,
        overlap=overlap,
        radius=joint.radius,
        information=_in_ros_order(solution.matrix, target.origin),
        free_motions=_free_motions(hold, target.origin),
    )


def _in_ros_order(matrix, origin):
    """Move the matrix from the target's origin to its frame, and put the translation first."""
    to_origin = se3.adjoint(se3.translation(-origin))
    return (to_origin.T @ matrix @ to_origin)[np.ix_(ROS_ORDER, ROS_ORDER)]


def _free_motions(hold, origin):
    """Return (k, 6) motions in the target's frame, the translation first."""
    from_origin = se3.adjoint(se3.translation(origin))
    return (from_origin @ hold.motions[:, hold.free]).T[:, ROS_ORDER]


def _without_solution(T, status):
    return RegistrationResult(T, status, 0, 0.0, 0.0, 0.0, 0.0, np.zeros((6, 6)), np.empty((0, 6)))
