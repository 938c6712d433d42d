"""Whether the residuals of a result turn with azimuth: the mark of a sweep that was not undone.

A spinning LiDAR that moves measures each azimuth at another time. What is left over in a sector
then asks for another motion than in the next, as of two poses, at the sweep's begin and end.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Integers, Point, Points, Transform
from idem_ros.core.geometry import se3
from idem_ros.core.solve.cost import JointEntropy
from idem_ros.core.trust.covariance import linearized
from idem_ros.core.trust.observability import Observability
from idem_ros.core.trust.verdict import Assessment

SECTORS = 32
SEAMS = 0, SECTORS // 2  # where a sweep begins: ahead of the sensor, or behind it
SAMPLE = 800  # centres of each cloud, about
ALL_AROUND = 24  # sectors at least in which surfaces meet: else it is no sensor that spins
A_LITTLE = 0.02  # of the mean stiffness of a sector
# Of 48 pairs of simulated scans of standing sensors none moves by as much and is as sure of it; of
# as many smeared at 1 to 20 m/s and 20 to 90 deg/s all but one or two.
LEAST_MOTION, LEAST_SQUARES = 0.25, 4.0
SAID = 'the residuals turn with azimuth: motion of the sweep?'


class Turning(NamedTuple):
    """How the residuals turn with azimuth."""

    motion: float  # that would undo it: how far the surfaces move during a sweep, over the radius
    squares: float  # of that motion over its deviations, the mean


def said_of_smear(
    said: Assessment, cost: JointEntropy, T: Transform, origin: Point, observability: Observability
) -> Assessment:
    """Return an `Assessment` that names a motion of the sweep, where the residuals show one.

    Args:
        said: of a result whose motion was not solved.
        cost: of the last stage.
        T: (4, 4) the result, between the clouds' origins.
        origin: (3,) that of the source's cloud, in the sensor's frame.
        observability: at the result.
    """
    found = turning(cost, T, origin, observability)
    if found is None or found.motion < LEAST_MOTION or found.squares < LEAST_SQUARES:
        return said
    return replace(said, reason=f'{said.reason}; {SAID}')


def turning(
    cost: JointEntropy, T: Transform, origin: Point, observability: Observability
) -> Turning | None:
    """Return the `Turning` of a result, by the seam where it shows most; None: it has no sectors.

    The arguments are those of `said_of_smear`.
    """
    target, source = (cloud.grid.points for cloud in cost.balls.clouds)
    back, held = se3.inverse(T), observability.held
    some = [np.arange(0, len(each), max(len(each) // SAMPLE, 1)) for each in (target, source)]
    seen = se3.transform_points(back, target[some[0]]), source[some[1]]
    sectors = [_sectors(points + origin) for points in seen]
    turns = [each[np.argsort(of, kind='stable')] for each, of in zip(some, sectors, strict=True)]
    groups = [np.zeros(len(each), np.int64) for each in (target, source)]
    for group, each, of in zip(groups, some, sectors, strict=True):
        group[each] = of
    pulls, stiffness = linearized(cost, T, turns, groups, SECTORS)
    firm = stiffness[:, 3:, 3:].trace(axis1=1, axis2=2)
    if (firm > A_LITTLE * firm.mean()).sum() < ALL_AROUND or held.shape[1] == 0:
        return None
    pulls, stiffness = pulls @ held, held.T @ stiffness @ held
    found = (
        _of_two_poses(np.roll(pulls, seam, axis=0), np.roll(stiffness, seam, axis=0))
        for seam in SEAMS
    )
    motion, squares = max(found, key=lambda each: each[1])
    return Turning(motion / cost.balls.radius, squares)


def _of_two_poses(pulls: Floats, stiffness: Floats) -> tuple[float, float]:
    """Return how far apart Newton's two poses are, and that over its deviations, squared.

    The deviations are by what the sectors still pull at the two poses.

    Args:
        pulls: (SECTORS, k) gradients, from the sweep's begin on.
        stiffness: (SECTORS, k, k) matrices, likewise.
    """
    k = pulls.shape[1]
    share = np.stack([np.ones(SECTORS), (np.arange(SECTORS) + 0.5) / SECTORS - 0.5])
    gradient = np.einsum('ag,gi->ai', share, pulls).reshape(-1)
    matrix = np.einsum('ag,bg,gij->aibj', share, share, stiffness).reshape(2 * k, 2 * k)
    inverse = np.asarray(np.linalg.pinv(matrix), np.float64)
    step = -inverse @ gradient
    moved = np.einsum('ag,ai->gi', share, step.reshape(2, k))
    rest = pulls + np.einsum('gij,gj->gi', stiffness, moved)
    each = np.einsum('ag,gi->gai', share, rest).reshape(SECTORS, -1) @ inverse
    apart, spread = step[k:], (each.T @ each)[k:, k:]
    squares = float(apart @ np.asarray(np.linalg.pinv(spread), np.float64) @ apart) / k
    return float(np.linalg.norm(apart)), squares


def _sectors(points: Points) -> Integers:
    turn = np.arctan2(points[:, 1], points[:, 0]) / (2.0 * np.pi)
    return np.floor(turn * SECTORS).astype(np.int64) % SECTORS
