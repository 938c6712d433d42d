"""Can a pose be trusted? A verdict with its probability and reason, and a covariance."""

from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

import numpy as np

from idem_ros.core import joint_cloud, se3
from idem_ros.core.basin import gauge
from idem_ros.core.contrast import contrasts_of_each
from idem_ros.core.covariance import by_region, covariance_of
from idem_ros.core.joint_entropy import JointEntropy
from idem_ros.core.noise import quantile, share_of_sheets
from idem_ros.core.solver import newton_step
from idem_ros.core.stages import LEAST_POINTS, descend
from idem_ros.core.status import Status
from idem_ros.core.verdict_model import probability
from idem_ros.core.words import free_in_words

ROS_ORDER = [3, 4, 5, 0, 1, 2]  # of (omega, v): translation first
LEAST_OVERLAP = 0.05  # of the points: below, a verdict speaks of too little of the clouds
CREDIBLE = 0.5
LEAST_MEETING = 100  # points of each cloud: fewer agree at many poses, by chance
# Scans of LiDARs as given have 0.5 and more, at voxels 0.7; where rings lie apart, below 0.2.
LEAST_SHEETS = 1 / 3
NOTHING_KNOWN = 1e6  # variance, in the clouds' unit squared and rad^2
TENTH = 0.9  # quantile of q_i: a tenth of the points that meet agree no better
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
    covariance: np.ndarray = field(default_factory=lambda: NOTHING_KNOWN * np.eye(6))
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


class Solve(NamedTuple):
    """What a solve knows of the pose that it ended at."""

    status: Status
    credibility: float
    first: JointEntropy  # of its first stage
    T_guess: np.ndarray  # (4, 4), between the clouds' origins


def judged(joint, differences, T, hold, overlap, origin, solve):
    """Return the `Assessment` of a pose.

    Args:
        joint: `JointEntropy` at the last radius.
        differences: its `per_point` there.
        T: (4, 4) the pose, between the clouds' origins.
        hold: its `Hold` there.
        overlap: share of the points that have a neighbour in the other cloud.
        origin: (3,) of the source cloud in the source frame.
        solve: the `Solve` that ended there.
    """
    if overlap == 0.0:
        reason = f'no point has a neighbour in the other cloud within {joint.radius:.3g}'
        return Assessment(Verdict.SEPARATED, 0.0, reason)
    differences = _over_radius(joint, differences, T)
    pulls, stiffness = by_region(joint, T, hold)
    seen = {
        'discord': _discord(differences),
        'contrast': _least_contrast(joint, T, hold, differences),
        'step': _step(hold, pulls.sum(axis=0), stiffness.sum(axis=0)) / joint.radius,
    }
    meeting = min(int(np.count_nonzero(reach)) for _, reach in differences)
    audited = solve.status is Status.AUDITED
    lacking = _lacking(joint, hold)
    enough = overlap >= LEAST_OVERLAP and meeting >= LEAST_MEETING and not lacking
    p = float(probability(**seen)) if enough else np.nan
    free = free_in_words(hold, T[:3, :3])
    covariance = covariance_of(joint, T, hold, pulls, stiffness)
    position = T[:3, 3] - T[:3, :3] @ origin
    return Assessment(
        *_verdict(p, seen, overlap, meeting, lacking, free, solve),
        free=free,
        covariance=_of_pose(covariance, position),
        overlap=overlap,
        basin=np.nan if audited else float(gauge(solve.first, T, solve.T_guess)),
        **seen,
    )


def swap_gap(prepared, T_guess, T, hold):
    """Return how far from a result the registration of target to source ends.

    Both minimise the same, from the same guess: a gap is an alarm. As the surfaces move, in the
    clouds' unit; nan where a motion is free: each way has its own idea of it.
    """
    if hold.free.any():
        return np.nan
    swapped = prepared._replace(clouds=prepared.clouds[::-1], ours=prepared.ours[::-1])
    back = descend(swapped, se3.inverse(T_guess)).solution.transform
    off = np.linalg.solve(hold.units, se3.log(T @ back))
    return float(np.linalg.norm(off))


def too_little(target, source):
    """Return the `Assessment` of clouds that have too few points, or all in one place."""
    counts = f'{len(target)} and {len(source)} points (or voxels)'
    few = min(len(target), len(source)) < LEAST_POINTS
    reason = f'{counts}: {f"{LEAST_POINTS} are needed" if few else "all in one place"}'
    return Assessment(Verdict.NOT_CONVERGED, np.nan, reason)


def _over_radius(joint, differences, T):
    """Return what `per_point` does of lengths over the radius, whatever was minimised."""
    if joint.scale == joint.radius:
        return differences
    sides = joint.target, joint.source
    points = (side.grid.points for side in sides)
    found = joint_cloud.differences(*points, T, joint.radius, joint.radius)
    return [
        of_cells[:, np.argsort(side.order)] for side, of_cells in zip(sides, found, strict=True)
    ]


def _discord(differences):
    """Return the q_i (Eq. 7) that a tenth of the points that meet exceed, lengths over the radius.

    Where surfaces coincide, joining them adds no entropy; where they stand apart, it does.
    """
    meeting = np.concatenate([q[reach > 0.0] for q, reach in differences])
    return quantile(meeting, TENTH)


def _least_contrast(joint, T, hold, differences):
    """Return the least rise of q_mean where surfaces that hold a motion move by a radius."""
    held = [hold.held_by(k) for k in np.flatnonzero(~hold.free)]
    if not held:
        return 0.0
    motions, holders = zip(*held, strict=True)
    q = [q for q, _ in differences]
    return float(contrasts_of_each(joint, T, np.transpose(motions), holders, q, HOLDERS).min())


def _step(hold, gradient, matrix):
    """Return how far the next step along the motions held would move the surfaces."""
    held = hold.motions[:, ~hold.free]
    along, _ = newton_step(held.T @ matrix @ held, held.T @ gradient)
    return float(np.linalg.norm(along))


def _lacking(joint, hold):
    """Say what keeps the clouds from telling a surface; empty where nothing does."""
    if not len(hold.along):
        return 'no ball of points is dense enough to tell a surface by'
    sides = joint.target, joint.source
    if max(share_of_sheets(side.unit_own) for side in sides) < LEAST_SHEETS:
        return 'most balls hold lines, as rings of a LiDAR, which fit anywhere: use larger voxels'
    return ''


def _verdict(p, seen, overlap, meeting, lacking, free, solve):
    """Return the verdict, the probability and the reason."""
    discord, contrast, step = seen['discord'], seen['contrast'], seen['step']
    if overlap < LEAST_OVERLAP:
        share = f'{overlap:.1%} of the points have a neighbour in the other cloud'
        return Verdict.LOW_OVERLAP, p, share
    if meeting < LEAST_MEETING:
        few = f'{meeting} points of a cloud have a neighbour in the other, {LEAST_MEETING} must'
        return Verdict.NOT_CONVERGED, p, few
    if lacking and not free:
        return Verdict.NOT_CONVERGED, p, lacking
    if p < CREDIBLE:
        if solve.credibility < CREDIBLE:
            return Verdict.OUTSIDE_BASIN, p, 'the coarse stages found no valley around the guess'
        if contrast < 0.0:
            reason = f'a radius away the clouds agree better, by {-contrast:.2g} nat a point'
            return Verdict.MISALIGNED, p, reason
        if probability(discord, contrast, step=0.0) < CREDIBLE:
            reason = f'a tenth of the points that meet disagree by {discord:.2g} nat or more'
            return Verdict.MISALIGNED, p, reason
        return Verdict.MISALIGNED, p, f'the minimum is {step:.2g} radii away, or more'
    if free:
        return Verdict.DEGENERATE, p, f'{free} of the source frame'
    if solve.status in (Status.MAX_ITERATIONS, Status.LATE):
        return Verdict.NOT_CONVERGED, p, f'the solver stopped early: {solve.status.value}'
    return Verdict.ALIGNED, p, f'the surfaces coincide, the next step is {step:.1g} radii'


def _of_pose(covariance, position):
    """Move the covariance of a twist about the target's origin to that of the source frame's pose.

    The source's origin moves by v + omega x position; the translation comes first.
    """
    moved = np.eye(6)
    moved[3:, :3] = -se3.skew(position)
    return (moved @ covariance @ moved.T)[np.ix_(ROS_ORDER, ROS_ORDER)]
