"""Can a pose be trusted? A verdict with its probability and reason, and a covariance."""

from dataclasses import replace

import numpy as np

from idem_ros.core.arrays import Floats, Matrix6, Transform, Twist
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.solve.cost import Linearization
from idem_ros.core.solve.descent import Descent
from idem_ros.core.solve.newton import Termination, newton_step
from idem_ros.core.solve.pair import LEAST_POINTS, Pair
from idem_ros.core.solve.sweep_cost import of_common_twist
from idem_ros.core.trust.agreement import Agreement, discord
from idem_ros.core.trust.audit import audited, offset_of
from idem_ros.core.trust.basin import gauge, way_between
from idem_ros.core.trust.constraining_surfaces import holders_of
from idem_ros.core.trust.contrast import contrasts_along
from idem_ros.core.trust.covariance import covariance_of, model_error_covariance
from idem_ros.core.trust.observability import Observability
from idem_ros.core.trust.pose_twist import pose_covariance, sweep_covariance, to_pose
from idem_ros.core.trust.reasons import (
    Evidence,
    free_in_words,
    lack_of,
    separated,
    verdict_and_reason,
)
from idem_ros.core.trust.regions import by_region
from idem_ros.core.trust.residuals import residual_diagnosis
from idem_ros.core.trust.sweep_covariance import by_region_in_motion, covariance_in_motion
from idem_ros.core.trust.verdict import NOTHING_KNOWN, Assessment, Verdict, probability

HOLDER_SAMPLE = 32  # centres of each cloud, about, that tell the contrast along a motion


def assess(
    pair: Pair,
    given: tuple[Cloud, Cloud],
    descent: Descent,
    T_guess: Transform,
    agreement: Agreement,
    observability: Observability,
) -> Assessment:
    """Return the `Assessment` of the pose that a `Descent` ended at.

    Args:
        pair: the `Pair` of clouds.
        given: the two `Cloud`s as they were given.
        descent: the `Descent` through its stages.
        T_guess: (4, 4) that it started from, between the clouds' origins.
        agreement: the `Agreement` where it ended.
        observability: the `Observability` there.
    """
    assert descent.cost is not None, 'a pose is judged by its cost'
    balls, T = descent.cost.balls, descent.solution.transform
    if agreement.overlap.share == 0.0:
        return Assessment(Verdict.SEPARATED, 0.0, separated(given, T_guess, balls.radius))
    total, both, told = _pull_and_covariance(pair, descent, agreement, observability)
    covariance = both[:6, :6]
    evidence, of_all = _evidence_and_discord(descent, T_guess, agreement, observability)
    lack = lack_of(agreement, balls, observability, pair.trust)
    p = np.nan if lack else float(probability(*evidence))
    free = free_in_words(observability, T[:3, :3])
    position = T[:3, 3] - T[:3, :3] @ pair.source.origin
    more, unknown = model_error_covariance(pair.config.model_error), NOTHING_KNOWN * np.eye(6)
    verdict, reason = verdict_and_reason(p, evidence, lack, free, descent)
    is_solved = descent.solution.termination is not Termination.NOT_STARTED
    assessment = Assessment(
        verdict,
        p,
        f'{reason}; {told}' if told else reason,
        free=free,
        covariance=unknown if lack else pose_covariance(covariance, position) + more,
        basin=gauge(descent.first or balls, T, T_guess, evidence.way) if is_solved else np.nan,
        sweep_covariance=sweep_covariance(both, position),
        discord=of_all,
        step=_step(observability, *total) / balls.radius,
        **evidence._replace(overlap=agreement.overlap.share)._asdict(),
    )
    if pair.config.mode != 'audit':
        return assessment
    offset = offset_of(T_guess, T, observability)
    moved = np.linalg.norm(np.linalg.solve(observability.motions, offset)) / balls.radius
    constrained = pose_covariance(_along_held(covariance, observability), position) + more
    of_minimum = replace(assessment, step=float(moved))
    return audited(
        of_minimum, to_pose(position) @ offset, constrained, pair.config.audit_tolerance
    )


def _evidence_and_discord(
    descent: Descent, T_guess: Transform, agreement: Agreement, observability: Observability
) -> tuple[Evidence, float]:
    """Return what `probability` goes by, and the discord of all that meet."""
    assert descent.cost is not None, 'a pose is judged by its cost'
    balls, T = descent.cost.balls, descent.solution.transform
    of_all, nearby = discord(balls, agreement, T)
    evidence = Evidence(
        near_discord=nearby,
        contrast=_least_contrast(balls, T, observability, agreement.q),
        overlap=agreement.overlap.most,
        way=way_between(descent.first or balls, T, T_guess),
    )
    return evidence, of_all


def _pull_and_covariance(
    pair: Pair, descent: Descent, agreement: Agreement, observability: Observability
) -> tuple[Linearization, Floats, str]:
    """Return gradient and matrix, the covariance, and what residuals tell.

    The covariance is (6, 6), or (12, 12) with a twist solved.
    """
    cost, T = descent.cost, descent.solution.transform
    assert cost is not None, 'a pose is judged by its cost'
    trust, jumps = pair.trust, pair.trust.jumps if pair.sampling.jumps else 1.0
    if descent.moving is None:
        found = by_region(cost, T, observability, agreement.moments)
        covariance = covariance_of(cost, T, observability, found, trust.in_common)
        constrained, radius = observability.constrained, cost.balls.radius
        told, smear = residual_diagnosis(found, T, pair.source.origin, constrained, radius)
        return found.total, trust.alike_surfaces * jumps * covariance + smear, told
    regions = by_region_in_motion(descent.moving, cost, T, observability)
    both = covariance_in_motion(regions, descent.moving.sweep, cost, T, observability)
    return of_common_twist(regions), trust.alike * jumps * both, ''


def too_little(target: Cloud, source: Cloud) -> Assessment:
    """Return the `Assessment` of clouds that have too few points, or all in one place."""
    counts = f'{len(target)} and {len(source)} points (or voxels)'
    few = min(len(target), len(source)) < LEAST_POINTS
    reason = f'{counts}: {f"{LEAST_POINTS} are needed" if few else "all in one place"}'
    return Assessment(Verdict.NOT_CONVERGED, np.nan, reason)


def out_of_time() -> Assessment:
    """Return the `Assessment` of a pose that there was no time to judge."""
    return Assessment(Verdict.NOT_CONVERGED, np.nan, 'the budget was spent before it was judged')


def _least_contrast(balls: Balls, T: Transform, observability: Observability, q: Floats) -> float:
    """Return the least rise of q_mean where surfaces that determine a motion move by a radius."""
    balls.workers.require_time()
    if not observability.observable.any():
        return 0.0
    of_points = q[: len(balls.of[0])], q[len(balls.of[0]) :]
    rises = contrasts_along(balls, T, holders_of(observability, HOLDER_SAMPLE), of_points)
    return float(rises.min())


def _step(observability: Observability, gradient: Twist, matrix: Matrix6) -> float:
    """Return how far the next step along the observable motions would move the surfaces."""
    constrained = observability.constrained
    along, _ = newton_step(constrained.T @ matrix @ constrained, constrained.T @ gradient)
    return float(np.linalg.norm(along))


def _along_held(covariance: Matrix6, observability: Observability) -> Floats:
    """Return the (6, 6) covariance, but that of the observable motions alone."""
    back = np.linalg.inv(observability.motions)[observability.observable]
    only = observability.constrained @ back
    along: Floats = only @ covariance @ only.T
    return along
