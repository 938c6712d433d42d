"""Register two clouds by minimising q_tot: the algorithm on one page."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from idem_ros.core import se3
from idem_ros.core.cloud import as_cloud
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.linearization import SUMS, linearize, unpack
from idem_ros.core.metric import (
    between_origins,
    differences,
    from_origins,
    length_unit,
    search_radius,
)
from idem_ros.core.solver import minimize_on_se3

NOISE = 0.005  # of the radius: standard deviation added to every axis of a covariance
BLOCK = 1024  # centres summed together: fixed, so that sums do not depend on who computes them
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
    target, source = as_cloud(target), as_cloud(source)
    T = np.eye(4) if T_target_source is None else se3.checked_transform(T_target_source)
    judged = [_reduced(cloud, config.voxel_size) for cloud in (target, source)]
    if min(len(cloud) for cloud in judged) < LEAST_POINTS:
        return _without_solution(T, Status.TOO_FEW_POINTS, 0.0)
    radius = search_radius(*judged, config.a)  # Eq. 9
    if radius == 0.0:
        return _without_solution(T, Status.DEGENERATE, 0.0)
    iterations = 0
    for factor in config.radius_schedule:
        clouds = [_stage(cloud, config.voxel_size, factor, radius) for cloud in (target, source)]
        solution = _solve_stage(*clouds, T, factor * radius, config)  # Eq. 14
        T, iterations = solution.transform, iterations + solution.iterations
    return _result(judged, solution, factor * radius, iterations, config)


def _reduced(cloud, voxel_size):
    return cloud if voxel_size is None else cloud.voxel_means(voxel_size)


def _stage(cloud, voxel_size, factor, radius):
    """The cloud of one stage: its neighbourhoods hold about as many members at every radius."""
    if voxel_size is not None:
        return cloud.voxel_moments(factor * voxel_size)
    return cloud if factor <= 1.0 else cloud.voxel_moments(factor * radius)


def _solve_stage(target, source, T_target_source, radius, config):
    def linearized(transform):
        return _linearize_both(target, source, transform, radius, config.length_scale)

    solution = minimize_on_se3(
        linearized,
        between_origins(target, source, T_target_source),
        config.max_iterations,
        config.rotation_tolerance,
        config.translation_tolerance * radius,
    )
    return solution._replace(transform=from_origins(target, source, solution.transform))


def _linearize_both(target, source, T_target_source, radius, length_scale):
    """Gradient and matrix of q_tot: the source moves around the target, and conversely."""
    T_source_target = se3.inverse(T_target_source)
    gradient, matrix = _linearize_side(target, source, T_target_source, radius, length_scale)
    there = _linearize_side(source, target, T_source_target, radius, length_scale)
    # exp(xi) T has the inverse exp(-Ad(T)^-1 xi) T^-1.
    back = se3.adjoint(T_source_target)
    return gradient - back.T @ there[0], matrix + back.T @ there[1] @ back


def _linearize_side(centres, others, T_centres_others, radius, length_scale):
    scale = length_unit(length_scale, radius)
    own = centres.neighbourhoods(radius, scale)
    grid = others.neighbourhoods(radius, scale).grid
    R, t = np.ascontiguousarray(T_centres_others[:3, :3]), T_centres_others[:3, 3].copy()
    noise, points = (NOISE * radius) ** 2, own.grid.points
    sums = np.zeros((len(points) // BLOCK + 1, SUMS))
    for b, begin in enumerate(range(0, len(points), BLOCK)):
        end = min(begin + BLOCK, len(points))
        linearize(points, own.moments, grid, R, t, radius, scale, noise, begin, end, sums[b])
    return unpack(sums.sum(axis=0))


def _result(judged, solution, radius, iterations, config):
    T = solution.transform
    (q_t, reach_t), (q_s, reach_s) = differences(*judged, T, radius, config.length_scale)
    q = float(q_t.sum() + q_s.sum())
    within = int(np.count_nonzero(reach_t) + np.count_nonzero(reach_s))
    if within == 0:
        status = Status.NO_OVERLAP
    elif solution.free:
        status = Status.DEGENERATE
    else:
        status = Status.CONVERGED if solution.converged else Status.MAX_ITERATIONS
    return RegistrationResult(
        T_target_source=T,
        status=status,
        iterations=iterations,
        q_tot=q,
        q_mean=q / within if within else 0.0,
        overlap=within / (len(q_t) + len(q_s)),
        radius=radius,
        information=_in_ros_order(solution.matrix, judged[0].origin),
    )


def _in_ros_order(matrix, origin):
    """Move the matrix from the target's origin to its frame, and put the translation first."""
    to_origin = np.eye(4)
    to_origin[:3, 3] = -origin
    moved = se3.adjoint(to_origin).T @ matrix @ se3.adjoint(to_origin)
    order = [3, 4, 5, 0, 1, 2]
    return moved[np.ix_(order, order)]


def _without_solution(T, status, radius):
    return RegistrationResult(T, status, 0, 0.0, 0.0, 0.0, radius, np.zeros((6, 6)))
