"""Register two clouds by minimising q_tot: the algorithm on one page.

Prepare, radius (Eq. 9), stages coarse to fine: in each linearise, solve, accept and terminate
(`newton.minimize`); result, assessment. The costs (Eq. 4 to 8) are in `cost`.
"""

from dataclasses import replace
from time import perf_counter
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Transform
from idem_ros.core.blocks import OutOfTime, Workers, in_threads
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.geometry import se3
from idem_ros.core.loose import held_to_guess, seen_there
from idem_ros.core.maps.map_cloud import MapCloud
from idem_ros.core.maps.target import (
    Target,
    TargetLike,
    as_source,
    as_target,
    in_reach,
    with_common_voxel_size,
)
from idem_ros.core.metric.balls import between_origins, from_origins
from idem_ros.core.metric.cloud import Cloud, CloudLike
from idem_ros.core.metric.voxel_size import size_found
from idem_ros.core.result import (
    RegistrationResult,
    agreement_at,
    result_at,
    weighed_against,
    weighed_against_twist,
)
from idem_ros.core.solve.descent import Descent, not_begun
from idem_ros.core.solve.newton import Termination
from idem_ros.core.solve.pair import LEAST_POINTS, Pair, prepare
from idem_ros.core.solve.sweep import Sweep, sweep_of
from idem_ros.core.solve.tuning import SolverTuning, TrustTuning
from idem_ros.core.stages import descend, minimum_beside, of_its_target, stay
from idem_ros.core.status import Status
from idem_ros.core.trust.assessment import assess, out_of_time, too_little
from idem_ros.core.trust.observability import Observability
from idem_ros.core.trust.outside import outside
from idem_ros.core.trust.prior import Guess, information_of_guess
from idem_ros.core.trust.scope import judged_in_scope
from idem_ros.core.trust.verdict import Assessment

GRACE = 0.15, 0.015  # of the budget, or [s]: for a late result's verdict
SOLVER, TRUST = SolverTuning(), TrustTuning()


def register(
    target: TargetLike,
    source: CloudLike,
    T_target_source: ArrayLike | None = None,
    config: RegistrationConfig | None = None,
    *,
    twist: ArrayLike | None = None,
    guess_covariance: ArrayLike | None = None,
    tuning: SolverTuning = SOLVER,
    trust: TrustTuning = TRUST,
) -> RegistrationResult:
    """Refine the pose of the source in the target frame by minimising q_tot (Eq. 8).

    With `mode="audit"` nothing moves: the guess itself is judged.

    Args:
        target: (N, 3) points, a `Cloud` or a `MapCloud`, in the target frame.
        source: (M, 3) points or a `Cloud`, in the source frame.
        T_target_source: (4, 4) initial guess; None: identity.
        config: `RegistrationConfig`; None: its defaults.
        twist: (6,) x y z [length/s] rx ry rz [rad/s] of the source frame in its own axes during
            the sweep of a source with times; what `config.motion` undoes. The guess, like the
            result, is the pose at `config.motion_reference`.
        guess_covariance: (6, 6) x y z rx ry rz of the guess: of the source frame's pose in the
            target frame, about its own origin; a variance of 0 says nothing of its axis. What the
            clouds hold weakly is weighed against it, unless the result is farther from the guess
            than it allows; of an audit, or with assessment none, it counts for nothing. None:
            `config.guess_sigma`.
        tuning: other numbers for the solver to go by.
        trust: other numbers for the verdict to go by.

    Returns:
        A `RegistrationResult`; whether it converged is a value, not an exception.

    Raises:
        InvalidCloud, InvalidTransform, InvalidConfig: for input that is no cloud, no rigid
            transform or twist, no covariance, or no `RegistrationConfig`.
    """
    config = RegistrationConfig() if config is None else config
    if not isinstance(config, RegistrationConfig):
        raise InvalidConfig(f'config is {config!r}; it must be a RegistrationConfig')
    workers = workers_of(config)
    T = np.eye(4) if T_target_source is None else se3.checked_transform(T_target_source)
    target, source = _clouds(target, source, config)
    sweep = sweep_of(source, twist, config)  # what is known of the sensor's motion
    guess = Guess(T, information_of_guess(guess_covariance, config))
    return registered(target, sweep, guess, config, tuning, trust, workers)


def registered(
    target: Target,
    sweep: Sweep,
    guess: Guess,
    config: RegistrationConfig,
    tuning: SolverTuning,
    trust: TrustTuning,
    both_workers: tuple[Workers, Workers],
) -> RegistrationResult:
    """Return the result of a target and the source of a `Sweep`, from a `Guess`.

    both_workers: those of the solve, and those of the verdict of a late result.
    """
    (workers, late_workers), source = both_workers, sweep.undone()
    T = guess.transform
    config = with_common_voxel_size(config, target, source)
    try:
        near = in_reach(target, source, T, config, workers)  # all of a cloud, some of a map
        if isinstance(target, MapCloud) and len(near) < LEAST_POINTS:
            return _unsolved(T, Status.NO_OVERLAP, config, outside(target.bounds, source, T))
        pair = prepare(near, source, config, tuning, trust, workers)  # voxels; radius of Eq. 9
    except OutOfTime:
        return _unsolved(T, Status.LATE, config, out_of_time())
    if not pair.stages:
        status = Status.TOO_FEW_POINTS if pair.is_small else Status.DEGENERATE
        return _unsolved(T, status, config, too_little(*pair.clouds))
    pair = pair.swept_as(sweep)
    T_guess = between_origins(near, source, T)
    guess = guess._replace(transform=T_guess)
    descent, observability = _refined(pair, T_guess)  # stages, coarse to fine
    try:
        pair = pair._replace(workers=late_workers)
        return _judged(pair, (near, source), guess, descent, observability)
    except OutOfTime:
        T = from_origins(near, source, descent.solution.transform)
        return _unsolved(T, Status.LATE, config, out_of_time(), descent.iterations)


def _clouds(
    target: TargetLike, source: CloudLike, config: RegistrationConfig
) -> tuple[Target, Cloud]:
    """Return both, prepared at once where there are two threads."""
    found: list[Target] = in_threads(
        Workers(config.threads),
        lambda each: each[0](each[1]),
        [(as_target, target), (as_source, source)],
    )
    return found[0], cast(Cloud, found[1])


def _refined(pair: Pair, T_guess: Transform) -> tuple[Descent, Observability | None]:
    """Return the `Descent` from a guess, and the `Observability` where it ended; None if late."""
    descent, follow = not_begun(T_guess), stay if pair.config.mode == 'audit' else descend
    try:
        descent = follow(pair, T_guess)
        if descent.cost is None:
            return descent, None
        if follow is descend and pair.config.free_motions == 'guess':
            return held_to_guess(pair, T_guess, descent)
        return descent, seen_there(pair, descent)
    except OutOfTime:
        late = descent.solution._replace(termination=Termination.LATE)
        return descent._replace(solution=late), None


def _judged(
    pair: Pair,
    given: tuple[Cloud, Cloud],
    guess: Guess,
    descent: Descent,
    observability: Observability | None,
) -> RegistrationResult:
    """Return the `RegistrationResult` of a descent; in its own time, where the solve was late.

    given: the two `Cloud`s as they were given.
    """
    T = descent.solution.transform
    pair = pair.moved_by(descent.sweep).around(T)
    before, descent = descent, of_its_target(pair, descent)
    cost = descent.cost
    assert cost is not None, 'it is of the last stage'
    cost.balls.workers = pair.workers
    if observability is None or descent is not before:  # what it saw were another part's points
        observability = seen_there(pair, descent)
    agreement, q_tot = agreement_at(pair, cost.balls, T)
    result = result_at(pair, descent, agreement, q_tot, observability)
    if pair.config.assessment == 'none':
        return result
    if pair.config.mode == 'audit':
        descent = minimum_beside(descent, pair, observability.held)
        T = descent.solution.transform
        agreement, _ = agreement_at(pair, cost.balls, T)
    T_guess = guess.transform
    said = assess(pair, given, descent, T_guess, agreement, observability)
    said = judged_in_scope(said, *given, cost.balls, agreement, T)
    if pair.config.assessment == 'swap':
        said = replace(said, swap_gap=_swap_gap(pair, T_guess, T, observability))
    result = replace(result, assessment=said)
    result, T = weighed_against_twist(descent.sweep, result, pair, T)
    return weighed_against(guess, result, pair, T)


def _swap_gap(pair: Pair, T_guess: Transform, T: Transform, observability: Observability) -> float:
    """Return how far from a result the registration of target to source ends.

    Both minimise the same, from the same guess: a gap is an alarm. As the surfaces move, in the
    clouds' unit; nan where a motion is free: each way has its own idea of it.
    """
    if not observability.observable.all():
        return np.nan
    back = descend(pair.swapped(), se3.inverse(T_guess)).solution.transform
    return float(np.linalg.norm(np.linalg.solve(observability.units, se3.log(T @ back))))


def _unsolved(
    T: Transform,
    status: Status,
    config: RegistrationConfig,
    said: Assessment | None,
    iterations: int = 0,
) -> RegistrationResult:
    """Return the result of clouds of which nothing is observable: the guess, and why."""
    said = None if config.assessment == 'none' else said
    termination = Termination.LATE if status is Status.LATE else Termination.NOT_STARTED
    return RegistrationResult(
        T,
        status,
        iterations,
        observable=np.zeros(6, bool),
        termination=termination,
        assessment=said,
        voxel_size=size_found(config),
    )


def workers_of(config: RegistrationConfig) -> tuple[Workers, Workers]:
    """Return the `Workers` of the solve, and those of a late result's verdict."""
    if config.budget_ms is None:
        return Workers(config.threads), Workers(config.threads)
    budget = 1e-3 * config.budget_ms
    end = perf_counter() + budget
    share, least = GRACE
    return Workers(config.threads, end), Workers(config.threads, end + max(share * budget, least))
