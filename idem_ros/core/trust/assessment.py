"""Can a pose be trusted? A verdict with its probability and reason, and a covariance."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Matrix6, MomentRows, Point, Points, Transform, Twist
from idem_ros.core.geometry import se3
from idem_ros.core.jit import kernel
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.metric.noise import quantile, share_of_surfaces
from idem_ros.core.metric.overlap import Overlap
from idem_ros.core.solve.cost import Linearization
from idem_ros.core.solve.descent import Descent
from idem_ros.core.solve.moving import of_common_twist
from idem_ros.core.solve.newton import Termination, newton_step
from idem_ros.core.solve.pair import LEAST_POINTS, Pair
from idem_ros.core.trust.audit import audited, offset_of
from idem_ros.core.trust.basin import gauge, way_between
from idem_ros.core.trust.contrast import contrasts_along
from idem_ros.core.trust.covariance import by_region, covariance_of, of_model
from idem_ros.core.trust.moving_covariance import by_region_in_motion, covariance_in_motion
from idem_ros.core.trust.observability import Observability
from idem_ros.core.trust.pose_twist import pose_covariance, sweep_covariance, to_pose
from idem_ros.core.trust.residuals import told_by_residuals
from idem_ros.core.trust.surfaces import LEAST_MEMBERS
from idem_ros.core.trust.verdict import LEAST_PROBABILITY, NOTHING_KNOWN, Assessment, Verdict
from idem_ros.core.trust.verdict_model import probability
from idem_ros.core.trust.words import free_in_words
from idem_ros.core.trust_tuning import TrustTuning

# Scans of LiDARs as given have 0.5 and more, at voxels 0.7; where rings lie apart, below 0.2.
LEAST_SHEETS = 1 / 3
TENTH = 0.9  # quantile of q_i: a tenth of the points that meet agree no better
NEAR = 1 / 3  # of the points that meet: the nearest ones
WIDER = 10.0  # times one cloud over the other, and their units are in doubt
HOLDERS = 32  # centres of each cloud, about, that tell the contrast along a motion


class _Seen(NamedTuple):
    """What the model of the verdict judges by."""

    near_discord: float
    contrast: float
    overlap: float
    way: float


class Agreement(NamedTuple):
    """How the clouds agree at a pose, point by point; lengths over the radius."""

    q: Floats  # (N + M,): q_i (Eq. 7) of the target's and of the source's points
    reach: Floats  # (N + M,): points of the other cloud in reach
    meeting: int  # points of a cloud that have one, at the least
    overlap: Overlap  # shares of points that have one
    # (N, 10) and (M, 10): of a `Meeting`, the target's and the source's
    moments: tuple[MomentRows, MomentRows]


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
    cost, T = descent.cost, descent.solution.transform
    assert cost is not None, 'a pose is judged by its cost'
    balls, trust = cost.balls, pair.trust
    if agreement.overlap.share == 0.0:
        return Assessment(Verdict.SEPARATED, 0.0, _separated(given, T_guess, balls.radius))
    total, both, told = _pull_and_covariance(pair, descent, agreement, observability)
    covariance = both[:6, :6]
    discord, near_discord = _discord(balls, agreement, T)
    seen = _Seen(
        near_discord=near_discord,
        contrast=_least_contrast(balls, T, observability, agreement.q),
        overlap=agreement.overlap.most,
        way=way_between(descent.first or balls, T, T_guess),
    )
    lacking = _lacking(agreement, balls, observability, trust)
    p = np.nan if lacking else float(probability(*seen))
    free = free_in_words(observability, T[:3, :3])
    position = T[:3, 3] - T[:3, :3] @ pair.source.origin
    more, unknown = of_model(pair.config.model_error), NOTHING_KNOWN * np.eye(6)
    verdict, p, reason = _verdict(p, seen, lacking, free, descent)
    said = Assessment(
        verdict,
        p,
        f'{reason}; {told}' if told else reason,
        free=free,
        covariance=unknown if lacking else pose_covariance(covariance, position) + more,
        basin=_basin(descent, balls, T_guess),
        sweep_covariance=sweep_covariance(both, position),
        discord=discord,
        step=_step(observability, *total) / balls.radius,
        **seen._replace(overlap=agreement.overlap.share)._asdict(),
    )
    if pair.config.mode != 'audit':
        return said
    off = offset_of(T_guess, T, observability)
    moved = np.linalg.norm(np.linalg.solve(observability.motions, off)) / balls.radius
    held = pose_covariance(_along_held(covariance, observability), position)
    said = replace(said, step=float(moved))
    return audited(said, to_pose(position) @ off, held + more, pair.config.audit_tolerance)


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
        held, radius = observability.held, cost.balls.radius
        told, smear = told_by_residuals(found, T, pair.source.origin, held, radius)
        total = Linearization(found.pulls.sum(axis=0), found.stiffness.sum(axis=0))
        return total, trust.alike_surfaces * jumps * covariance + smear, told
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


def _separated(given: tuple[Cloud, Cloud], T_guess: Transform, radius: float) -> str:
    """Return why no point meets the other cloud, and what to look at."""
    bounds = np.array([cloud.extent() for cloud in given])  # (2, 2, 3)
    middles: Floats = bounds.mean(axis=1)
    apart: Floats = T_guess[:3, :3] @ middles[1] + T_guess[:3, 3] - middles[0]
    gap = float(np.linalg.norm(apart))
    reason = (
        f'no point has a neighbour in the other cloud within {radius:.3g}; '
        f'their middles are {gap:.3g} apart at the guess'
    )
    widths = np.ptp(bounds, axis=1).max(axis=1)
    if widths.max() > WIDER * widths.min():
        wide, other = widths
        return f'{reason}; the target is {wide:.3g} wide, the source {other:.3g}: the same unit?'
    return f'{reason}: is the guess right?'


def _discord(balls: Balls, agreement: Agreement, T: Transform) -> tuple[float, float]:
    """Return the q_i (Eq. 7) that a tenth of the points that meet exceed, lengths over the radius.

    Where surfaces coincide, joining them adds no entropy; where they stand apart, it does. Of all
    of these points, and of those nearest to the sensor: its noise grows with the range, so that
    what stands apart nearby is none.
    """
    balls.workers.require_time()
    target, source = balls.of
    sensor = -source.origin  # where the source frame has its origin
    sensors = se3.transform_points(T, sensor), sensor
    q, ranges = _meeting(target.points, source.points, sensors, agreement.q, agreement.reach)
    nearby = ranges <= quantile(ranges, NEAR)
    return quantile(q, TENTH), quantile(q[nearby], TENTH)


@kernel
def _meeting(
    target: Points, source: Points, sensors: tuple[Point, Point], q: Floats, reach: Floats
) -> tuple[Floats, Floats]:
    """Return q_i and squared distance from the sensor of the points that meet, the target's first.

    sensors: where it is in the frame of either.
    """
    found, squared = np.empty(len(q)), np.empty(len(q))
    n = 0
    for i in range(len(q)):
        if reach[i] == 0.0:
            continue
        k = i if i < len(target) else i - len(target)
        cloud = target if i < len(target) else source
        at = sensors[0] if i < len(target) else sensors[1]
        x, y, z = cloud[k, 0] - at[0], cloud[k, 1] - at[1], cloud[k, 2] - at[2]
        found[n], squared[n] = q[i], x * x + y * y + z * z
        n += 1
    return found[:n], squared[:n]


def _least_contrast(balls: Balls, T: Transform, observability: Observability, q: Floats) -> float:
    """Return the least rise of q_mean where surfaces that determine a motion move by a radius."""
    balls.workers.require_time()
    of_each = observability.determined()
    if not of_each:
        return 0.0
    motions, holders = zip(*of_each, strict=True)
    of_points = q[: len(balls.of[0])], q[len(balls.of[0]) :]
    rises = contrasts_along(balls, T, np.stack(motions, axis=1), holders, HOLDERS, of_points)
    return float(rises.min())


def _step(observability: Observability, gradient: Twist, matrix: Matrix6) -> float:
    """Return how far the next step along the motions held would move the surfaces."""
    held = observability.held
    along, _ = newton_step(held.T @ matrix @ held, held.T @ gradient)
    return float(np.linalg.norm(along))


def _along_held(covariance: Matrix6, observability: Observability) -> Floats:
    """Return the (6, 6) covariance, but that of the motions held alone."""
    back = np.linalg.inv(observability.motions)[observability.observable]
    only = observability.held @ back
    along: Floats = only @ covariance @ only.T
    return along


def _lacking(
    agreement: Agreement, balls: Balls, observability: Observability, trust: TrustTuning
) -> tuple[Verdict, str, bool] | None:
    """Return verdict, reason, whether a free motion says more; None where the clouds can tell."""
    if agreement.overlap.share < trust.least_overlap:
        share = f'{agreement.overlap.share:.1%} of the points have a neighbour in the other cloud'
        return Verdict.LOW_OVERLAP, f'{share}: is the guess right, and the unit the same?', False
    if agreement.meeting < trust.least_meeting:
        few = (
            f'{agreement.meeting} points of a cloud have a neighbour in the other, '
            f'{trust.least_meeting} must'
        )
        return Verdict.NOT_CONVERGED, few, False
    if not any((cloud.own[:, 0] >= LEAST_MEMBERS).any() for cloud in balls.clouds):
        reason = 'no ball of points is dense enough to tell a surface by'
        return Verdict.NOT_CONVERGED, reason, True
    if max(share_of_surfaces(cloud.own) for cloud in balls.clouds) < LEAST_SHEETS:
        rings = 'most balls hold lines, as rings of a LiDAR, which fit anywhere: use larger voxels'
        return Verdict.NOT_CONVERGED, rings, True
    if not len(observability.along):
        return Verdict.NOT_CONVERGED, 'no ball holds a surface of both clouds', True
    return None


def _verdict(
    p: float,
    seen: _Seen,
    lacking: tuple[Verdict, str, bool] | None,
    free: str,
    descent: Descent,
) -> tuple[Verdict, float, str]:
    """Return the verdict, the probability and the reason."""
    if lacking:
        verdict, reason, gives_way = lacking
        if not (gives_way and free):
            return verdict, p, reason
    if p < LEAST_PROBABILITY:
        if descent.confidence < LEAST_PROBABILITY:
            reason = 'the coarse stages found no valley around the guess'
            return Verdict.OUTSIDE_BASIN, p, reason
        return Verdict.MISALIGNED, p, _misaligned(seen)
    ended = descent.solution.termination
    # Late, motions that nothing determines have not yet been put back to where they were guessed.
    if ended is Termination.LATE or (ended is Termination.MAX_ITERATIONS and not free):
        reason = f'the solver stopped early: {ended.value}'
        return Verdict.NOT_CONVERGED, p, reason
    if free:
        return Verdict.DEGENERATE, p, f'{free} of the source frame'
    told = f'the surfaces coincide; nearby a tenth disagree by {seen.near_discord:.1g} nat'
    return Verdict.ALIGNED, p, told


def _basin(descent: Descent, balls: Balls, T_guess: Transform) -> float:
    """Return where the guess was in the basin; nan where nothing was solved."""
    if descent.solution.termination is Termination.NOT_STARTED:
        return np.nan
    return float(gauge(descent.first or balls, descent.solution.transform, T_guess))


def _misaligned(seen: _Seen) -> str:
    """Return why a pose is taken to be wrong."""
    if probability(*seen._replace(way=0.0)) >= LEAST_PROBABILITY:
        return f'it is {seen.way:.2g} radii of the first stage from the guess, beyond its basin'
    if seen.contrast < 0.0:
        return f'a radius away the clouds agree better, by {-seen.contrast:.2g} nat a point'
    return (
        f'a tenth of the points that meet nearby disagree by {seen.near_discord:.2g} nat or more'
    )
