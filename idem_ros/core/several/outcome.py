"""Joint results, by the numbers that the clouds were given by."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Mask, Matrix6, RotationMatrix, Transforms
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.geometry import se3
from idem_ros.core.metric.voxel_size import size_found, with_voxel_size
from idem_ros.core.registration import register
from idem_ros.core.result import RegistrationResult
from idem_ros.core.several.edges import judged_as, turned_around
from idem_ros.core.several.joint_agreement import JointAgreement
from idem_ros.core.several.joint_descent import JointSolution
from idem_ros.core.several.joint_result import CloudVerdict, Edge, JointResult
from idem_ros.core.several.problem import Problem
from idem_ros.core.several.system import parts_of
from idem_ros.core.solve.newton import Termination
from idem_ros.core.solve.pair import LEAST_POINTS
from idem_ros.core.status import Status
from idem_ros.core.trust.verdict import NOTHING_KNOWN, Verdict
from idem_ros.core.trust_tuning import TrustTuning
from idem_ros.core.tuning import SolverTuning

_LATE = CloudVerdict(Verdict.NOT_CONVERGED, np.nan, 'the budget was spent before it was judged')


class Found(NamedTuple):
    """What a solve found, in its own order of the clouds."""

    numbers: Sequence[int]  # that these were given by
    poses: Transforms  # (K, 4, 4) of their frames
    fixed: Mask  # (K,)
    radius: float
    agreement: JointAgreement | None = None  # None: there was no time
    edges: Sequence[Edge] = ()
    verdicts: Sequence[CloudVerdict] = ()  # none: there was no time, or they were not asked for
    covariance: Floats | None = None  # (6 K, 6 K); None: not asked for


def outcome(
    problem: Problem,
    config: RegistrationConfig,
    sizes: Sequence[int],
    solution: JointSolution,
    found: Found,
) -> JointResult:
    """Return the `JointResult` of a solve; sizes: points of each cloud that was given."""
    count, numbers = len(problem.clouds), list(found.numbers)
    poses = problem.poses.copy()
    poses[numbers] = found.poses
    edges = sorted((_renumbered(edge, numbers, poses) for edge in found.edges), key=_ends)
    held = sorted(numbers[k] for k in np.flatnonzero(found.fixed))
    verdicts = [_too_few(size) for size in sizes]
    for k, assessment in zip(numbers, found.verdicts or [_LATE] * len(numbers), strict=True):
        verdicts[k] = assessment
    return JointResult(
        poses=poses,
        covariance=_spread(found.covariance, numbers, count),
        held=tuple(held),
        status=_status(solution, found),
        termination=solution.termination,
        iterations=solution.iterations,
        q_tot=found.agreement.q_tot if found.agreement else 0.0,
        q_means=_q_means(found.agreement, numbers, count),
        edges=tuple(edges),
        verdicts=tuple(verdicts) if config.assessment != 'none' else (),
        parts=_parts(edges, count),
        radius=found.radius,
        voxel_size=size_found(config),
    )


def unsolved(
    problem: Problem, config: RegistrationConfig, sizes: Sequence[int] = ()
) -> JointResult:
    """Return the result of clouds that could not be registered, or not in time: the guesses.

    sizes: points of each cloud; none: the time was spent before they were known.
    """
    few = sum(size < LEAST_POINTS for size in sizes)
    verdicts = [_too_few(size) for size in sizes] or [_LATE] * len(problem.clouds)
    status = Status.TOO_FEW_POINTS if few else Status.DEGENERATE if sizes else Status.LATE
    return JointResult(
        poses=problem.poses,
        covariance=NOTHING_KNOWN * np.eye(6 * len(problem.clouds)),
        held=problem.held,
        status=status,
        termination=Termination.NOT_STARTED if sizes else Termination.LATE,
        verdicts=tuple(verdicts) if config.assessment != 'none' else (),
        parts=tuple((k,) for k in range(len(problem.clouds))),
        voxel_size=size_found(config) if sizes else None,
    )


def pair_outcome(
    problem: Problem, config: RegistrationConfig, tuning: SolverTuning, trust: TrustTuning
) -> JointResult:
    """Return the `JointResult` of two clouds of which one is held: that of `register`."""
    (h,), config = problem.held, with_voxel_size(config, *problem.clouds)
    k = 1 - h
    target, source = problem.clouds[h], problem.clouds[k]
    T = se3.inverse(problem.poses[h]) @ problem.poses[k]
    result = register(target, source, T, config, tuning=tuning, trust=trust)
    poses = problem.poses.copy()
    poses[k] = poses[h] @ result.T_target_source
    edge, verdicts = _edge_and_verdicts(result)
    if h == 1:
        edge = replace(turned_around(edge, result.T_target_source), i=0, j=1)
    covariance = np.zeros((12, 12))
    covariance[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = _of_pair(result, poses[h, :3, :3])
    meet = result.overlap > 0.0
    return JointResult(
        poses=poses,
        covariance=covariance,
        held=(h,),
        status=result.status,
        termination=result.termination,
        iterations=result.iterations,
        q_tot=result.q_tot,
        q_means=(result.q_mean,) * 2,
        edges=(edge,) if meet else (),
        verdicts=verdicts,
        parts=((0, 1),) if meet else ((0,), (1,)),
        radius=result.radius,
        voxel_size=result.voxel_size,
    )


def _edge_and_verdicts(result: RegistrationResult) -> tuple[Edge, tuple[CloudVerdict, ...]]:
    edge, assessment = Edge(0, 1, result.overlap, result.q_mean), result.assessment
    if assessment is None:
        return edge, ()
    verdict = CloudVerdict(assessment.verdict, assessment.p_aligned, assessment.reason)
    edge = replace(edge, **judged_as(assessment))
    if edge.gap is None:  # they are where the two alone have them
        edge = replace(edge, gap=np.zeros(6))
    return edge, (verdict, verdict)


def _of_pair(result: RegistrationResult, R: RotationMatrix) -> Matrix6:
    """Return a result's covariance in the axes of the common frame; R: of the target's pose."""
    if result.assessment is None:
        return NOTHING_KNOWN * np.eye(6)
    turn = np.kron(np.eye(2), R)
    return turn @ result.assessment.covariance @ turn.T


def _renumbered(edge: Edge, numbers: Sequence[int], poses: Transforms) -> Edge:
    i, j = numbers[edge.i], numbers[edge.j]
    edge = replace(edge, i=i, j=j)
    return edge if i < j else turned_around(edge, se3.inverse(poses[i]) @ poses[j])


def _ends(edge: Edge) -> tuple[int, int]:
    return edge.i, edge.j


def _spread(covariance: Floats | None, numbers: Sequence[int], count: int) -> Floats:
    """Return a covariance by the given numbers; nothing is known of clouds that it has not."""
    whole = NOTHING_KNOWN * np.eye(6 * count)
    if covariance is not None:
        places = (6 * np.array(numbers)[:, None] + np.arange(6)).ravel()
        whole[np.ix_(places, places)] = covariance
    return whole


def _q_means(
    agreement: JointAgreement | None, numbers: Sequence[int], count: int
) -> tuple[float, ...]:
    means = np.zeros(count)
    if agreement is not None:
        means[list(numbers)] = agreement.q / np.maximum(agreement.meeting, 1.0)
    return tuple(means.tolist())


def _parts(edges: Sequence[Edge], count: int) -> tuple[tuple[int, ...], ...]:
    pairs = np.array([_ends(edge) for edge in edges], int).reshape(-1, 2)
    part = parts_of(pairs, count)
    return tuple(
        tuple(np.flatnonzero(part == number).tolist()) for number in range(part.max() + 1)
    )


def _status(solution: JointSolution, found: Found) -> Status:
    if found.agreement is not None and not found.edges:
        return Status.NO_OVERLAP
    if solution.termination is Termination.NOT_STARTED:
        return Status.AUDITED
    return Status(solution.termination.value)


def _too_few(size: int) -> CloudVerdict:
    lacking = f'{LEAST_POINTS} are needed' if size < LEAST_POINTS else 'no other has enough'
    reason = f'{size} points (or voxels): {lacking}'
    return CloudVerdict(Verdict.NOT_CONVERGED, np.nan, reason)
