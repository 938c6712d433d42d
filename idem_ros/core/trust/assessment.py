"""Can a pose be trusted? A verdict with its probability and reason, and a covariance."""

from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple, TypedDict

import numpy as np

from idem_ros.core.arrays import Floats, Matrix6, Point, Transform, Twist
from idem_ros.core.geometry import se3
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.metric.noise import quantile, share_of_sheets
from idem_ros.core.solve.descent import Descent
from idem_ros.core.solve.newton import Termination, newton_step
from idem_ros.core.solve.pair import LEAST_POINTS, Pair
from idem_ros.core.solve.tuning import TrustTuning
from idem_ros.core.trust.basin import gauge
from idem_ros.core.trust.contrast import contrast_along
from idem_ros.core.trust.covariance import by_region, covariance_of
from idem_ros.core.trust.observability import Observability
from idem_ros.core.trust.surfaces import LEAST_MEMBERS
from idem_ros.core.trust.verdict_model import probability
from idem_ros.core.trust.words import free_in_words

ROS_ORDER = [3, 4, 5, 0, 1, 2]  # of (omega, v): translation first
LEAST_PROBABILITY = 0.5
# Scans of LiDARs as given have 0.5 and more, at voxels 0.7; where rings lie apart, below 0.2.
LEAST_SHEETS = 1 / 3
NOTHING_KNOWN = 1e6  # variance, in the clouds' unit squared and rad^2
TENTH = 0.9  # quantile of q_i: a tenth of the points that meet agree no better
WIDER = 10.0  # times one cloud over the other, and their units are in doubt
HOLDERS = 32  # centres of each cloud, about, that tell the contrast along a motion


class Verdict(Enum):
    """What is to be thought of a pose."""

    ALIGNED = 'aligned'
    MISALIGNED = 'misaligned'
    LOW_OVERLAP = 'low_overlap'
    SEPARATED = 'separated'
    DEGENERATE = 'degenerate'
    OUTSIDE_BASIN = 'outside_basin'
    NOT_CONVERGED = 'not_converged'


@dataclass(frozen=True, eq=False)
class Assessment:
    """A verdict on a pose, and what it stands on."""

    verdict: Verdict
    p_aligned: float  # probability that it is right along every motion held; nan: unknown
    reason: str
    free: str = ''  # the motions that nothing holds, in words, in the source's axes
    # (6, 6), x y z rx ry rz: of the source frame's pose in the target frame, about its own origin
    covariance: Matrix6 = field(default_factory=lambda: NOTHING_KNOWN * np.eye(6))
    # 90th percentile of q_i over the points that have a neighbour in the other cloud [nat]
    discord: float = np.nan
    # least rise of q_mean a radius away along a motion, of the points that hold it [nat]
    contrast: float = np.nan
    step: float = 0.0  # how far the next step would move the surfaces, over the radius
    overlap: float = 0.0
    # where the guess was: 0 at the minimum, 1 at the rim of its basin; nan: an audit
    basin: float = np.nan
    # how far from it the registration of target to source ends, as the surfaces move, in the
    # clouds' unit; nan: not asked for
    swap_gap: float = np.nan


class _Seen(TypedDict):
    discord: float
    contrast: float
    step: float


class Agreement(NamedTuple):
    """How the clouds agree at a pose, point by point; lengths over the radius."""

    q: Floats  # (N + M,): q_i (Eq. 7) of the target's and of the source's points
    reach: Floats  # (N + M,): points of the other cloud in reach
    meeting: int  # points of a cloud that have one, at the least
    overlap: float  # share of all points that have one


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
    if agreement.overlap == 0.0:
        return Assessment(Verdict.SEPARATED, 0.0, _separated(given, T_guess, balls.radius))
    pulls, stiffness = by_region(cost, T, observability)
    seen: _Seen = {
        'discord': _discord(agreement),
        'contrast': _least_contrast(balls, T, observability),
        'step': _step(observability, pulls.sum(axis=0), stiffness.sum(axis=0)) / balls.radius,
    }
    lacking = _lacking(agreement, balls, observability, trust)
    p = np.nan if lacking else float(probability(**seen))
    free = free_in_words(observability, T[:3, :3])
    covariance = covariance_of(cost, T, observability, pulls, stiffness)
    covariance *= trust.jumps if pair.sampling.jumps else 1.0
    position = T[:3, 3] - T[:3, :3] @ pair.source.origin
    return Assessment(
        *_verdict(p, seen, lacking, free, descent),
        free=free,
        covariance=_of_pose(covariance, position),
        overlap=agreement.overlap,
        basin=_basin(descent, balls, T_guess),
        **seen,
    )


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
    bounds = np.array([cloud.bounds() for cloud in given])  # (2, 2, 3)
    target, source = bounds.mean(axis=1)
    gap = np.linalg.norm(T_guess[:3, :3] @ source + T_guess[:3, 3] - target)
    reason = (
        f'no point has a neighbour in the other cloud within {radius:.3g}; '
        f'their middles are {gap:.3g} apart at the guess'
    )
    widths = np.ptp(bounds, axis=1).max(axis=1)
    if widths.max() > WIDER * widths.min():
        wide, other = widths
        return f'{reason}; the target is {wide:.3g} wide, the source {other:.3g}: the same unit?'
    return f'{reason}: is the guess right?'


def _discord(agreement: Agreement) -> float:
    """Return the q_i (Eq. 7) that a tenth of the points that meet exceed, lengths over the radius.

    Where surfaces coincide, joining them adds no entropy; where they stand apart, it does.
    """
    return quantile(agreement.q[agreement.reach > 0.0], TENTH)


def _least_contrast(balls: Balls, T: Transform, observability: Observability) -> float:
    """Return the least rise of q_mean where surfaces that determine a motion move by a radius."""
    of_each = (observability.determined_by(k) for k in np.flatnonzero(observability.observable))
    rises = [contrast_along(balls, T, *motion, HOLDERS) for motion in of_each]
    return min(rises, default=0.0)


def _step(observability: Observability, gradient: Twist, matrix: Matrix6) -> float:
    """Return how far the next step along the motions held would move the surfaces."""
    held = observability.held
    along, _ = newton_step(held.T @ matrix @ held, held.T @ gradient)
    return float(np.linalg.norm(along))


def _lacking(
    agreement: Agreement, balls: Balls, observability: Observability, trust: TrustTuning
) -> tuple[Verdict, str, bool] | None:
    """Return verdict, reason, whether a free motion says more; None where the clouds can tell."""
    if agreement.overlap < trust.least_overlap:
        share = f'{agreement.overlap:.1%} of the points have a neighbour in the other cloud'
        return Verdict.LOW_OVERLAP, share, False
    if agreement.meeting < trust.least_meeting:
        few = (
            f'{agreement.meeting} points of a cloud have a neighbour in the other, '
            f'{trust.least_meeting} must'
        )
        return Verdict.NOT_CONVERGED, few, False
    if not any((cloud.own[:, 0] >= LEAST_MEMBERS).any() for cloud in balls.clouds):
        reason = 'no ball of points is dense enough to tell a surface by'
        return Verdict.NOT_CONVERGED, reason, True
    if max(share_of_sheets(cloud.own) for cloud in balls.clouds) < LEAST_SHEETS:
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
        return Verdict.MISALIGNED, p, _misaligned(**seen)
    ended = descent.solution.termination
    # Late, motions that nothing determines have not yet been put back to where they were guessed.
    if ended is Termination.LATE or (ended is Termination.MAX_ITERATIONS and not free):
        reason = f'the solver stopped early: {ended.value}'
        return Verdict.NOT_CONVERGED, p, reason
    if free:
        return Verdict.DEGENERATE, p, f'{free} of the source frame'
    return Verdict.ALIGNED, p, f'the surfaces coincide, the next step is {seen["step"]:.1g} radii'


def _basin(descent: Descent, balls: Balls, T_guess: Transform) -> float:
    """Return where the guess was in the basin; nan where nothing was solved."""
    if descent.solution.termination is Termination.NOT_STARTED:
        return np.nan
    return float(gauge(descent.first or balls, descent.solution.transform, T_guess))


def _misaligned(discord: float, contrast: float, step: float) -> str:
    """Return why a pose is taken to be wrong."""
    if contrast < 0.0:
        return f'a radius away the clouds agree better, by {-contrast:.2g} nat a point'
    if probability(discord, contrast, step=0.0) < LEAST_PROBABILITY:
        return f'a tenth of the points that meet disagree by {discord:.2g} nat or more'
    return f'the minimum is {step:.2g} radii away, or more'


def _of_pose(covariance: Matrix6, position: Point) -> Matrix6:
    """Move the covariance of a twist about the target's origin to that of the source frame's pose.

    The source's origin moves by v + omega x position; the translation comes first.
    """
    moved = np.eye(6)
    moved[3:, :3] = -se3.skew(position)
    return (moved @ covariance @ moved.T)[np.ix_(ROS_ORDER, ROS_ORDER)]
