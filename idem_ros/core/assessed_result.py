"""A result with what is thought of it: a verdict, weighed against what was known before."""

from dataclasses import replace

import numpy as np

from idem_ros.core.arrays import Transform
from idem_ros.core.coarse_to_fine import descend, minimum_beside
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.geometry import se3
from idem_ros.core.maps.map_cloud import MapCloud
from idem_ros.core.maps.target import Target
from idem_ros.core.metric.balls import from_origins
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.metric.voxel_size import size_found
from idem_ros.core.result import RegistrationResult, agreement_at
from idem_ros.core.solve.descent import Descent
from idem_ros.core.solve.newton import Termination
from idem_ros.core.solve.pair import LEAST_POINTS, Pair
from idem_ros.core.solve.sweep import Sweep
from idem_ros.core.status import Status
from idem_ros.core.trust.agreement import Agreement
from idem_ros.core.trust.assessment import assess, out_of_time, too_little
from idem_ros.core.trust.moving_traffic import judged_beside_another
from idem_ros.core.trust.observability import Observability
from idem_ros.core.trust.prior import Guess, beyond_guess, weighed, weighed_twist
from idem_ros.core.trust.unsupported_input import judged_in_scope, outside
from idem_ros.core.trust.verdict import Assessment


def assessed(
    result: RegistrationResult,
    pair: Pair,
    given: tuple[Cloud, Cloud],
    guess: Guess,
    descent: Descent,
    agreement: Agreement,
    observability: Observability,
) -> RegistrationResult:
    """Return the result of a `Descent` with its `Assessment`, weighed against what was known.

    Args:
        result: without one.
        pair: the `Pair` as it lies at the result.
        given: the two `Cloud`s as they were given.
        guess: `Guess`, between the clouds' origins.
        descent: `Descent`.
        agreement, observability: where it ended.

    Raises:
        OutOfTime: the pair's workers are late.
    """
    assert descent.cost is not None, 'a result has the radius of its cost'
    T, balls = descent.solution.transform, descent.cost.balls
    if pair.config.mode == 'audit':
        descent = minimum_beside(descent, pair, observability.constrained)
        T = descent.solution.transform
        agreement, _ = agreement_at(pair, balls, T)
    assessment = assess(pair, given, descent, guess.transform, agreement, observability)
    assessment = judged_in_scope(assessment, *given, balls, agreement, T)
    reach = pair.stages[0].radius
    assessment = judged_beside_another(assessment, balls, observability, agreement, T, reach)
    if pair.config.assessment == 'swap':
        gap = _swap_gap(pair, guess.transform, T, observability)
        assessment = replace(assessment, swap_gap=gap)
    result = replace(result, assessment=assessment)
    result, T = _weighed_against_twist(descent.sweep, result, pair, T)
    return _weighed_against(guess, result, pair, T)


def unsolved(target: Target, pair: Pair, T: Transform) -> RegistrationResult:
    """Return the result of clouds of which nothing is observable: the guess, and why."""
    if isinstance(target, MapCloud) and len(pair.target) < LEAST_POINTS:
        nothing = outside(target.bounds, pair.source, T)
        return _as_guessed(T, Status.NO_OVERLAP, pair.config, nothing)
    status = Status.TOO_FEW_POINTS if pair.is_small else Status.DEGENERATE
    return _as_guessed(T, status, pair.config, too_little(*pair.clouds))


def late(T: Transform, config: RegistrationConfig, iterations: int) -> RegistrationResult:
    """Return the result of a pose that there was no time to judge."""
    return replace(
        _as_guessed(T, Status.LATE, config, out_of_time()),
        iterations=iterations,
        termination=Termination.LATE,
    )


def _as_guessed(
    T: Transform, status: Status, config: RegistrationConfig, assessment: Assessment
) -> RegistrationResult:
    return RegistrationResult(
        T,
        status,
        observable=np.zeros(6, bool),
        assessment=None if config.assessment == 'none' else assessment,
        voxel_size=size_found(config),
    )


def _swap_gap(pair: Pair, T_guess: Transform, T: Transform, observability: Observability) -> float:
    """Return how far from a result the registration of target to source ends.

    Both minimise the same, from the same guess: a gap is an alarm. As the surfaces move, in the
    clouds' unit; nan where a motion is free: each way has its own idea of it.
    """
    if not observability.observable.all():
        return np.nan
    back = descend(pair.swapped(), se3.inverse(T_guess)).solution.transform
    return float(np.linalg.norm(np.linalg.solve(observability.units, se3.log(T @ back))))


def _weighed_against(
    guess: Guess, result: RegistrationResult, pair: Pair, T: Transform
) -> RegistrationResult:
    """Return a result weighed against a guess of which it is known how far it may be off.

    As it is, where nothing is known, where it cannot be used, or where the guess is audited.

    Args:
        guess: `Guess`, between the clouds' origins.
        result: `RegistrationResult` with an assessment.
        pair: the `Pair`.
        T: (4, 4) its pose, between the clouds' origins.
    """
    assessment = result.assessment
    is_audit = pair.config.mode == 'audit'
    if assessment is None or is_audit or not (guess.information.any() and result.is_usable):
        return result
    position = T[:3, 3] - T[:3, :3] @ pair.source.origin
    found = weighed(T, assessment.covariance, guess.transform, guess.information, position)
    assessment = replace(assessment, covariance=found.covariance)
    if not found.is_believed:
        assessment = beyond_guess(assessment, found.distance)
    T = from_origins(pair.target, pair.source, found.transform)
    return replace(result, T_target_source=T, assessment=assessment)


def _weighed_against_twist(
    sweep: Sweep | None, result: RegistrationResult, pair: Pair, T: Transform
) -> tuple[RegistrationResult, Transform]:
    """Return a result and its pose weighed against the twist that its solve started from.

    As they are, where nothing was known of it, or where the result cannot be used.

    Args:
        sweep: the `Sweep` that was found.
        result: `RegistrationResult` with an assessment.
        pair: the `Pair`.
        T: (4, 4) its pose, between the clouds' origins.
    """
    assessment, sigma = result.assessment, pair.config.twist_sigma
    if assessment is None or assessment.sweep_covariance is None or not any(sigma):
        return result, T
    if sweep is None or sweep.given is None or result.twist is None or not result.is_usable:
        return result, T
    position = T[:3, 3] - T[:3, :3] @ pair.source.origin
    both = assessment.sweep_covariance
    found = weighed_twist(T, result.twist, both, sweep.given, sigma, position)
    if not found.is_believed:
        far = f'the twist is {found.distance:.2g} deviations from the one given'
        reason = f'{assessment.reason}; {far}, which is not weighed'
        assessment = replace(assessment, reason=reason)
        return replace(result, assessment=assessment), T
    less = assessment.covariance + (found.covariance - both)[:6, :6]
    assessment = replace(assessment, covariance=less, sweep_covariance=found.covariance)
    T = found.transform
    at = from_origins(pair.target, pair.source, T)
    return replace(result, T_target_source=at, twist=found.twist, assessment=assessment), T
