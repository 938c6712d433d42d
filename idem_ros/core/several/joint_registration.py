"""Register several clouds at once by minimising q_tot of their union: the algorithm on one page.

Prepare, stages coarse to fine of all poses together, covariance, the overlap graph, verdicts. Two
clouds of which one is held are `register`'s.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Point, Transforms
from idem_ros.core.config import AUTO, RegistrationConfig
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.metric.cloud import Cloud, CloudLike
from idem_ros.core.metric.entropy import length_unit
from idem_ros.core.metric.voxel_size import with_voxel_size
from idem_ros.core.several.edges import Audit, edges_of, judged, verdicts_of
from idem_ros.core.several.joint_agreement import agreement_at
from idem_ros.core.several.joint_balls import JointBalls
from idem_ros.core.several.joint_covariance import joint_covariance
from idem_ros.core.several.joint_descent import (
    JointCost,
    JointSolution,
    Known,
    gauge_of,
    minimize_all,
)
from idem_ros.core.several.joint_result import JointResult
from idem_ros.core.several.joint_stages import (
    JointStage,
    clouds_of_stage,
    joint_cost,
    joint_stages,
    reduced_clouds,
)
from idem_ros.core.several.outcome import Found, outcome, pair_outcome, unsolved
from idem_ros.core.several.problem import (
    PosePrior,
    Problem,
    between_middles,
    checked_problem,
    held_mask,
    in_common_order,
    shifted,
)
from idem_ros.core.solve.newton import Criteria, Termination
from idem_ros.core.solve.pair import LEAST_POINTS
from idem_ros.core.trust_tuning import TRUST, TrustTuning
from idem_ros.core.tuning import SOLVER, SolverTuning
from idem_ros.core.workers import OutOfTime, Workers, in_threads, workers_of

COARSE_CENTRES = 10_000  # balls, about, of the stages before the last, which only lead to it


def register_all(
    clouds: Sequence[CloudLike],
    poses: ArrayLike | None = None,
    config: RegistrationConfig | None = None,
    *,
    held: Iterable[int] | None = None,
    priors: Iterable[PosePrior] = (),
    tuning: SolverTuning = SOLVER,
    trust: TrustTuning = TRUST,
) -> JointResult:
    """Refine the poses of several clouds at once by minimising q_tot of their union (Eq. 8).

    The numbering of the clouds changes nothing: q_tot over n clouds has no target and no source.

    Args:
        clouds: two or more, each (N, 3) points or a `Cloud`, in its own frame.
        poses: (K, 4, 4) initial guesses, cloud frames to one common frame; None: identities.
        config: `RegistrationConfig`; None: its defaults. With `mode="audit"` nothing moves.
        held: numbers of the clouds whose poses stay; None: the first, or none where a prior is
            absolute. Of clouds that hang together and of which none is held, one stays.
        priors: `PosePrior`s, relative or absolute.
        tuning, trust: other numbers than the solver and the verdicts go by.

    Returns:
        A `JointResult`; whether it converged is a value, not an exception.

    Raises:
        InvalidCloud, InvalidTransform, InvalidConfig: for input that is no cloud, no rigid
            transform or no `RegistrationConfig`; it says which cloud.
    """
    config = RegistrationConfig() if config is None else config
    if not isinstance(config, RegistrationConfig):
        raise InvalidConfig(f'config is {config!r}; it must be a RegistrationConfig')
    workers, late_workers = workers_of(config.threads, config.budget_ms)
    problem = checked_problem(clouds, poses, held, priors, Workers(config.threads))
    if problem.is_a_pair:
        return pair_outcome(problem, config, tuning, trust)
    try:
        if config.voxel_size == AUTO:
            in_threads(workers, lambda cloud: cloud.voxel_fit(), problem.clouds)
        config = with_voxel_size(config, *problem.clouds)
        prepared = _prepared(problem, config, tuning, workers)
        if not prepared.stages:
            return unsolved(problem, config, prepared.sizes)
        cost, solution = _solved(prepared)
    except OutOfTime:
        return unsolved(problem, config)
    cost.balls.workers = late_workers
    try:
        return _judged(problem, prepared, cost, solution, trust)
    except OutOfTime:  # it is not even known which clouds hang together
        return unsolved(problem, config)


class _Prepared(NamedTuple):
    """Clouds on their voxels, in an order of their own, and where they start."""

    numbers: list[int]  # that they were given by; without those of too few points
    sizes: list[int]  # points of every cloud that was given
    reduced: list[Cloud]
    poses: Transforms  # (K, 4, 4) of the frames at their origins
    offset: Point  # that the poses were moved by, to be near zero: digits
    known: Known
    stages: list[JointStage]  # coarse to fine; none where nothing can be registered
    config: RegistrationConfig
    tuning: SolverTuning
    workers: Workers


def _prepared(
    problem: Problem, config: RegistrationConfig, tuning: SolverTuning, workers: Workers
) -> _Prepared:
    reduced = reduced_clouds(problem.clouds, config, workers)
    numbers = [k for k in in_common_order(problem) if len(reduced[k]) >= LEAST_POINTS]
    some = problem.of(numbers)
    offset = some.middles()[0] if numbers else np.zeros(3)
    priors = shifted(some.priors, offset)
    # One that is held fixes the frame alone: which one it is, no step need know.
    is_gauge = len(some.held) == 1 and all(prior.target is not None for prior in priors)
    held = held_mask(() if is_gauge else some.held, len(numbers))
    chosen = [reduced[k] for k in numbers]
    stages = joint_stages(chosen, config, tuning, workers) if len(numbers) > 1 else []
    return _Prepared(
        numbers=numbers,
        sizes=[len(cloud) for cloud in reduced],
        reduced=chosen,
        poses=between_middles(some, offset) if numbers else np.empty((0, 4, 4)),
        offset=offset,
        known=Known(held, priors, some.origins),
        stages=stages,
        config=config,
        tuning=tuning,
        workers=workers,
    )


def _solved(prepared: _Prepared) -> tuple[JointCost, JointSolution]:
    """Return where the stages ended, and the last one's cost.

    A descent that does not come to rest began too wide: once more without its first stage.
    """
    stages = prepared.stages
    if prepared.config.mode == 'audit':
        cost = _cost(prepared, stages[-1])
        return cost, JointSolution(prepared.poses, 0, Termination.NOT_STARTED)
    cost, solution = _descended(prepared, stages)
    while solution.termination is Termination.MAX_ITERATIONS and len(stages) > 1:
        stages, before = stages[1:], solution.iterations
        cost, solution = _descended(prepared, stages)
        solution = solution._replace(iterations=before + solution.iterations)
    return cost, solution


def _descended(
    prepared: _Prepared, stages: Sequence[JointStage]
) -> tuple[JointCost, JointSolution]:
    """Return where these stages end; each starts where the one before it ended."""
    poses, iterations = prepared.poses, 0
    cost, solution = _cost(prepared, stages[0]), None
    for stage in stages:
        cost = cost if stage is stages[0] else _cost(prepared, stage)
        solution = _minimized(prepared, cost, stage, poses)
        poses, iterations = solution.poses, iterations + solution.iterations
        if solution.termination is Termination.LATE:
            break
    assert solution is not None, 'there is a stage to go through'
    return cost, solution._replace(iterations=iterations)


def _minimized(
    prepared: _Prepared, cost: JointCost, stage: JointStage, poses: Transforms
) -> JointSolution:
    """Return where one stage ends."""
    criteria = _criteria(prepared, stage)
    cost.weigh_priors(poses)
    solution = minimize_all(cost, poses, criteria)
    if not (stage.is_last and prepared.known.priors):
        return solution
    before = solution.iterations
    cost.weigh_priors(solution.poses)  # by what the pulls are where they cancel
    solution = minimize_all(cost, solution.poses, criteria)
    return solution._replace(iterations=before + solution.iterations)


def _cost(prepared: _Prepared, stage: JointStage) -> JointCost:
    config, tuning, workers = prepared.config, prepared.tuning, prepared.workers
    clouds = clouds_of_stage(prepared.reduced, stage, config, workers)
    most = np.inf if stage.is_last else COARSE_CENTRES
    balls = JointBalls(clouds, stage.radius, workers, most_centres=most)
    return JointCost(balls, joint_cost(stage, config, tuning, balls.among_voxels), prepared.known)


def _criteria(prepared: _Prepared, stage: JointStage) -> Criteria:
    config, ease = prepared.config, 1.0 if stage.is_last else prepared.tuning.ease
    return Criteria(
        config.max_iterations,
        ease * config.rotation_tolerance,
        ease * config.translation_tolerance * stage.radius,
        prepared.workers,
        prepared.tuning,
    )


def _judged(
    problem: Problem,
    prepared: _Prepared,
    cost: JointCost,
    solution: JointSolution,
    trust: TrustTuning,
) -> JointResult:
    """Return the `JointResult`; in its own time, where the solve was late."""
    some, config, end = problem.of(prepared.numbers), prepared.config, solution.poses
    places = prepared.known, some.held, prepared.numbers, (prepared.poses, end), prepared.offset
    gauge = gauge_of(cost.parts(end), *places)
    poses = gauge.poses(end, some.origins, some.poses)
    found = Found(prepared.numbers, poses, gauge.fixed, cost.balls.radius)
    try:
        scale = length_unit(config.length_scale, cost.balls.radius)
        agreement = agreement_at(cost.balls, end, scale)
        found = found._replace(agreement=agreement, edges=edges_of(agreement))
        if config.assessment != 'none':
            covariance = joint_covariance(cost.with_fixed(gauge.fixed), end, trust)
            audit = Audit(poses, config, trust, cost.balls.workers)
            edges = judged(found.edges, some.clouds, audit)
            verdicts = verdicts_of(edges, some.clouds, gauge.fixed, found.radius, audit)
            covariance = gauge.covariance(covariance)
            found = found._replace(covariance=covariance, edges=edges, verdicts=verdicts)
    except OutOfTime:
        solution = solution._replace(termination=Termination.LATE)
    return outcome(problem, config, prepared.sizes, solution, found)
