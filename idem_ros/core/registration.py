"""Register two clouds by minimising q_tot: the algorithm on one page."""

from dataclasses import dataclass, field, replace

import numpy as np

from idem_ros.core import se3
from idem_ros.core.assessment import (
    ROS_ORDER,
    Assessment,
    Solve,
    judged,
    swap_gap,
    too_little,
)
from idem_ros.core.blocks import in_threads
from idem_ros.core.cloud import Cloud, as_cloud
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.constraint import hold_of
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.joint_entropy import between_origins, from_origins
from idem_ros.core.metric import overlap_of
from idem_ros.core.scope import judged_in_scope
from idem_ros.core.stages import descend, prepare, stay
from idem_ros.core.status import Status


@dataclass(frozen=True, eq=False)
class RegistrationResult:
    """The refined transform, and how well the clouds agree there."""

    T_target_source: np.ndarray  # (4, 4): p_target = R p_source + t
    status: Status
    iterations: int = 0  # steps over all stages
    q_tot: float = 0.0  # of the registered clouds (voxel means where voxel_size is given) [nat]
    q_mean: float = 0.0  # q_tot per point that has a neighbour in the other cloud [nat]
    overlap: float = 0.0  # fraction of the points that have one, of both clouds
    radius: float = 0.0  # search radius of the last stage, in the clouds' unit
    # (6, 6), x y z rx ry rz: stiffness against a motion of the source in the target frame
    information: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    # (k, 6), likewise: motions that no surface holds
    free_motions: np.ndarray = field(default_factory=lambda: np.empty((0, 6)))
    # how likely the solve succeeded, 0 to 1, by its coarse stages; nan: not asked for
    credibility: float = float('nan')
    assessment: Assessment | None = None  # None where it was not asked for

    @property
    def converged(self):
        """Whether the last stage ended in a point where no step moves the source."""
        return self.status is Status.CONVERGED


def register(target, source, T_target_source=None, config=None):
    """Refine the pose of the source in the target frame by minimising q_tot.

    With `mode="audit"` nothing moves: the guess itself is judged.

    Args:
        target: (N, 3) points or a `Cloud`, in the target frame.
        source: (M, 3) points or a `Cloud`, in the source frame.
        T_target_source: (4, 4) initial guess; None: identity.
        config: `RegistrationConfig`; None: its defaults.

    Returns:
        A `RegistrationResult`; whether it converged is a value, not an exception.

    Raises:
        InvalidCloud, InvalidTransform, InvalidConfig: for input that is no cloud, no rigid
            transform or no `RegistrationConfig`.
    """
    config = RegistrationConfig() if config is None else config
    if not isinstance(config, RegistrationConfig):
        raise InvalidConfig(f'config is {config!r}; it must be a RegistrationConfig')
    ours = tuple(not isinstance(points, Cloud) for points in (target, source))
    target, source = in_threads(config.threads, as_cloud, (target, source))
    T = np.eye(4) if T_target_source is None else se3.checked_transform(T_target_source)
    prepared = prepare(target, source, config, ours)  # Eq. 9
    if not prepared.stages or prepared.stages[-1].radius == 0.0:  # all points in one place
        status = Status.DEGENERATE if prepared.stages else Status.TOO_FEW_POINTS
        said = None if config.assessment == 'none' else too_little(*prepared.clouds)
        return RegistrationResult(T, status, assessment=said)
    T = between_origins(target, source, T)
    descent, hold = _descended(prepared, T)
    pose = descent.solution.transform
    differences = descent.joint.per_point(pose)
    result = _result(target, source, descent, differences, hold, config.mode)
    if config.assessment == 'none':
        return result
    solve = Solve(result.status, descent.credibility, descent.first, T)
    gap = swap_gap(prepared, T, pose, hold) if config.assessment == 'swap' else np.nan
    said = judged(descent.joint, differences, pose, hold, result.overlap, source.origin, solve)
    said = judged_in_scope(said, target, source, descent.joint, differences, pose)
    return replace(result, assessment=replace(said, swap_gap=gap))


def _descended(prepared, T):
    """Return the `Descent` from T, and the `Hold` that says what it may move."""
    config = prepared.config
    if config.mode == 'audit':
        descent = stay(prepared, T)
        return descent, hold_of(descent.joint, T)
    descent = descend(prepared, T)
    hold = hold_of(descent.joint, descent.solution.transform)
    if 0 < hold.free.sum() < 6 and config.free_motions == 'guess':
        descent = descend(prepared, T, hold.motions[:, ~hold.free])
    return descent, hold


def _result(target, source, descent, differences, hold, mode):
    joint, solution = descent.joint, descent.solution
    (q_target, reach_target), (q_source, reach_source) = differences
    q = float(q_target.sum() + q_source.sum())
    within, overlap = overlap_of(reach_target, reach_source)
    if within == 0:
        status = Status.NO_OVERLAP
    elif mode == 'audit':
        status = Status.AUDITED
    elif solution.free or hold.free.any():
        status = Status.DEGENERATE
    else:
        stopped = Status.LATE if descent.is_late else Status.MAX_ITERATIONS
        status = Status.CONVERGED if solution.converged else stopped
    return RegistrationResult(
        T_target_source=from_origins(target, source, solution.transform),
        status=status,
        iterations=descent.iterations,
        q_tot=q,
        q_mean=q / within if within else 0.0,
        overlap=overlap,
        radius=joint.radius,
        information=_in_ros_order(solution.matrix, target.origin),
        free_motions=_free_motions(hold, target.origin),
        credibility=descent.credibility,
    )


def _in_ros_order(matrix, origin):
    """Move the matrix from the target's origin to its frame, and put the translation first."""
    to_origin = se3.adjoint(se3.translation(-origin))
    return (to_origin.T @ matrix @ to_origin)[np.ix_(ROS_ORDER, ROS_ORDER)]


def _free_motions(hold, origin):
    """Return (k, 6) motions in the target's frame, the translation first."""
    from_origin = se3.adjoint(se3.translation(origin))
    return (from_origin @ hold.motions[:, hold.free]).T[:, ROS_ORDER]
