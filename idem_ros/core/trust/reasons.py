"""The verdict on a pose and the reason for it, in a sentence; free motions in words."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, RotationMatrix, Transform
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.metric.noise import LEAST_MEMBERS
from idem_ros.core.solve.descent import Descent
from idem_ros.core.solve.newton import Termination
from idem_ros.core.trust.agreement import Agreement
from idem_ros.core.trust.observability import Observability
from idem_ros.core.trust.verdict import LEAST_PROBABILITY, Verdict, probability
from idem_ros.core.trust_tuning import TrustTuning

# Scans of LiDARs as given have 0.5 and more, at voxels 0.7; where rings lie apart, below 0.2.
LEAST_SHEETS = 1 / 3
WIDER = 10.0  # times one cloud over the other, and their units are in doubt
AXES = 'xyz'
MOSTLY_TURN = 0.5  # of a unit motion: from here on it is named by its turn
ON_AXIS = 0.95  # of an axis within a subspace: from here on the subspace is named by its axes


class Evidence(NamedTuple):
    """What the model of the verdict judges by."""

    near_discord: float
    contrast: float
    overlap: float
    way: float


class Lack(NamedTuple):
    """Why the clouds cannot tell whether a pose is right."""

    verdict: Verdict
    reason: str
    gives_way: bool  # whether a motion that is free says more


def separated(given: tuple[Cloud, Cloud], T_guess: Transform, radius: float) -> str:
    """Return why no point meets the other cloud, and what to look at.

    Args:
        given: the two `Cloud`s as they were given.
        T_guess: (4, 4) between their origins.
        radius: of the balls.
    """
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


def lack_of(
    agreement: Agreement, balls: Balls, observability: Observability, trust: TrustTuning
) -> Lack | None:
    """Return the `Lack` of clouds at a pose; None where they can tell.

    Args:
        agreement: the `Agreement` there.
        balls: `Balls` of the last radius.
        observability: the `Observability` there.
        trust: what it is judged by.
    """
    if agreement.overlap.share < trust.least_overlap:
        share = f'{agreement.overlap.share:.1%} of the points have a neighbour in the other cloud'
        reason = f'{share}: is the guess right, and the unit the same?'
        return Lack(Verdict.LOW_OVERLAP, reason, gives_way=False)
    if agreement.meeting < trust.least_meeting:
        few = (
            f'{agreement.meeting} points of a cloud have a neighbour in the other, '
            f'{trust.least_meeting} must'
        )
        return Lack(Verdict.NOT_CONVERGED, few, gives_way=False)
    if max(shapes.surfaces for shapes in balls.shapes()) < LEAST_SHEETS:
        reason = (
            'most balls hold lines, as rings of a LiDAR, which fit anywhere: use larger voxels'
        )
        if not any((cloud.own[:, 0] >= LEAST_MEMBERS).any() for cloud in balls.clouds):
            reason = 'no ball of points is dense enough to tell a surface by'
        return Lack(Verdict.NOT_CONVERGED, reason, gives_way=True)
    if not len(observability.along):
        reason = 'no ball holds a surface of both clouds'
        return Lack(Verdict.NOT_CONVERGED, reason, gives_way=True)
    return None


def verdict_and_reason(
    p: float, evidence: Evidence, lack: Lack | None, free: str, descent: Descent
) -> tuple[Verdict, str]:
    """Return the `Verdict` on a pose, and why.

    Args:
        p: probability that it is right; nan where it lacks something.
        evidence: what that was judged by.
        lack: the `Lack` of the clouds there; None: they can tell.
        free: the motions that nothing holds, in words; empty: all are observable.
        descent: the `Descent` that ended there.
    """
    if lack and not (lack.gives_way and free):
        return lack.verdict, lack.reason
    if p < LEAST_PROBABILITY:
        if descent.confidence < LEAST_PROBABILITY:
            return Verdict.OUTSIDE_BASIN, 'the coarse stages found no valley around the guess'
        return Verdict.MISALIGNED, _misaligned(evidence)
    ended = descent.solution.termination
    # Late, motions that nothing determines have not yet been put back to where they were guessed.
    if ended is Termination.LATE or (ended is Termination.MAX_ITERATIONS and not free):
        return Verdict.NOT_CONVERGED, f'the solver stopped early: {ended.value}'
    if free:
        return Verdict.DEGENERATE, f'{free} of the source frame'
    told = f'the surfaces coincide; nearby a tenth disagree by {evidence.near_discord:.1g} nat'
    return Verdict.ALIGNED, told


def _misaligned(evidence: Evidence) -> str:
    """Return why a pose is taken to be wrong."""
    if probability(*evidence._replace(way=0.0)) >= LEAST_PROBABILITY:
        far = f'it is {evidence.way:.2g} radii of the first stage from the guess'
        return f'{far}, beyond its basin'
    if evidence.contrast < 0.0:
        return f'a radius away the clouds agree better, by {-evidence.contrast:.2g} nat a point'
    return (
        f'a tenth of the points that meet nearby disagree by {evidence.near_discord:.2g} nat '
        'or more'
    )


def free_in_words(observability: Observability, R_target_source: RotationMatrix) -> str:
    """Say which motions are unobservable.

    Args:
        observability: the `Observability` at the pose.
        R_target_source: (3, 3), so that the directions are those of the source's axes.

    Returns:
        A phrase; empty where none is free.
    """
    if observability.observable.all():
        return ''
    free = observability.axes[:, ~observability.observable]
    turns, moves = free[:3], free[3:]
    _, share, mixed = np.linalg.svd(turns)
    share = np.pad(share, (0, len(mixed) - len(share)))
    is_turn = share > MOSTLY_TURN
    said = [
        f'{how} {named(R_target_source.T @ vectors @ mixed[chosen].T)}'
        for how, vectors, chosen in (('along', moves, ~is_turn), ('about', turns, is_turn))
        if chosen.any()
    ]
    return f'free {" and ".join(said)}'


def named(directions: Floats) -> str:
    """Name the span of (3, k) directions by axes where it has them, else by its directions."""
    basis, _ = np.linalg.qr(directions)
    on_axis = np.linalg.norm(basis, axis=1) > ON_AXIS
    if on_axis.sum() == basis.shape[1]:
        return ' and '.join(AXES[i] for i in np.flatnonzero(on_axis))
    return ' and '.join('(' + ', '.join(f'{x:.2f}' for x in column) + ')' for column in basis.T)
