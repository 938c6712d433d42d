"""What the residuals of a result tell: that they turn with azimuth, or grow with range.

A spinning LiDAR that moves measures each azimuth at another time. What is left over in a sector
then asks for another motion than in the next, as of two poses, at the sweep's begin and end. A
cloud of another scale asks, the farther off, for the longer a way, outwards or inwards.
"""

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Matrix6,
    Point,
    Points,
    RotationMatrix,
    Transform,
    Twist,
    Twists,
)
from idem_ros.core.geometry import se3
from idem_ros.core.jit import kernel
from idem_ros.core.solve.newton import newton_step
from idem_ros.core.trust.regions import Regions

SECTORS = 32
SEAMS = 0.0, 0.5  # of a turn: where a sweep begins: ahead of the sensor, or behind it
ALL_AROUND = 24  # sectors at least in which surfaces meet: else it is no sensor that spins
A_LITTLE = 0.02  # of the mean stiffness of a sector
# Of 48 pairs of simulated scans of standing sensors none moves by as much and is as sure of it; of
# as many smeared at 1 to 20 m/s and 20 to 90 deg/s all but one or two.
LEAST_TURNING = 0.25, 4.0  # of the radius; of it over its deviations, squared, an axis
# 43 pairs of the same scale grow by 0.01 at most, 16 that are half a percent off by 0.08 and more,
# and surely so; of 27 that are smeared one does.
LEAST_GROWING = 0.05, 16.0
# Newton's one step falls short of the motion, as balls meet no more of what is farther off: by
# half, in the median of 23 such sweeps.
SHORT = 2.0
TURNING = 'the residuals turn with azimuth: motion of the sweep?'
GROWING = 'the residuals grow with range: is the scale of both the same?'


def residual_diagnosis(
    regions: Regions, T: Transform, origin: Point, constrained: Twists, radius: float
) -> tuple[str, Matrix6]:
    """Say that residuals show a motion of the sweep, or a scale; and what that adds, (6, 6).

    Where a motion was not undone the pose is that of no instant: at the sweep's begin, or its
    end, the sensor was half of the motion away, which is added to the covariance of the twist
    (omega, v). Empty and zeros where they show nothing.

    Args:
        regions: of a result whose motion was not solved.
        T: (4, 4) the result, between the clouds' origins.
        origin: (3,) that of the source's cloud, in the sensor's frame.
        constrained: (6, k) motions that are observable.
        radius: of the last stage.
    """
    if constrained.shape[1] == 0:
        return '', np.zeros((6, 6))
    sensor, R = se3.transform_points(T, -origin), np.ascontiguousarray(T[:3, :3])
    pulls, stiffness, places = regions[:3]
    away, turn, sectors, grown, sums = _about_sensor(pulls, stiffness, places, sensor, R)
    regions = regions._replace(places=away)
    # what grows may seem to turn, too, what turns hardly grows
    if _is_growing(regions, grown, sums, constrained, radius):
        return GROWING, np.zeros((6, 6))
    if sectors < ALL_AROUND:
        return '', np.zeros((6, 6))
    half = SHORT / 2 * _turning(regions, turn, constrained, radius)
    return TURNING if half.any() else '', np.outer(half, half)


def _turning(regions: Regions, turn: Floats, constrained: Twists, radius: float) -> Twist:
    """Return by which motion residuals turn with azimuth, wherever a sweep begins; zeros: none.

    turn: (G,) the azimuth of each region, 0 to 1.
    """
    found = [
        _between_ends(regions, (turn + seam) % 1.0 - 0.5, constrained, radius) for seam in SEAMS
    ]
    most: Twist = constrained @ max(found, key=lambda motion: float(motion @ motion))
    return most


def _between_ends(regions: Regions, time: Floats, constrained: Twists, radius: float) -> Floats:
    """Return (k,) from Newton's pose at the sweep's begin to that at its end; zeros: not surely.

    The deviations are by what the regions still pull at the two.

    Args:
        regions: `Regions`.
        time: (G,) of the sweep, from -0.5 at its begin to 0.5.
        constrained: (6, k) motions.
        radius: of the last stage.
    """
    motion, squares = LEAST_TURNING
    k = constrained.shape[1]
    along = np.ascontiguousarray(constrained)
    matrix, gradient = _over_time(regions.pulls, regions.stiffness, time, along)
    step, _ = newton_step(matrix, gradient)
    apart: Floats = step[k:]
    if np.linalg.norm(apart) < motion * radius:
        return np.zeros_like(apart)
    inverse = np.asarray(np.linalg.pinv(matrix, hermitian=True), np.float64)
    share = np.stack([np.ones(len(time)), time])
    moved = share.T @ step.reshape(2, k) @ constrained.T
    left: Floats = regions.pulls + np.einsum('gij,gj->gi', regions.stiffness, moved)
    each = (share.T[:, :, None] * (left @ constrained)[:, None]).reshape(len(time), -1) @ inverse
    spread = (each.T @ each)[k:, k:]
    is_sure = apart @ np.linalg.pinv(spread, hermitian=True) @ apart >= k * squares
    return apart if is_sure else np.zeros_like(apart)


def _is_growing(
    regions: Regions,
    grown: Twist,
    sums: tuple[float, float, float],
    constrained: Twists,
    radius: float,
) -> bool:
    """Whether residuals surely grow with range, as no motion of the whole undoes.

    A region is moved as one, outwards by a share of its range. The deviation is by what the
    regions still pull.

    grown, sums: of `_about_sensor`.
    """
    pulls, stiffness, places, (motion, squares) = *regions[:3], LEAST_GROWING
    undone, _ = newton_step(
        constrained.T @ regions.total.matrix @ constrained, constrained.T @ grown
    )
    common = constrained @ undone  # what all move by, beside each outwards
    firm = float(common @ grown) + sums[0]
    if firm <= 0.0:
        return False
    scale = -(float(common @ regions.total.gradient) + sums[1]) / firm
    if abs(scale) * np.sqrt(sums[2]) < motion * radius:
        return False
    alone: Floats = np.tile(common, (len(places), 1))
    alone[:, 3:] += places
    left: Floats = pulls + scale * np.einsum('gij,gj->gi', stiffness, alone)
    pulled: Floats = np.einsum('gi,gi->g', alone, left)
    return (scale * firm) ** 2 >= squares * float(pulled @ pulled)


@kernel
def _about_sensor(
    pulls: Floats, stiffness: Floats, places: Points, sensor: Point, R: RotationMatrix
) -> tuple[Points, Floats, int, Twist, tuple[float, float, float]]:
    """Return how G regions lie about a sensor, and what they pull where all grow about it.

    Args:
        pulls, stiffness, places: of `Regions`.
        sensor: (3,) in their frame.
        R: (3, 3) its axes there.

    Returns:
        Places (G, 3) from the sensor; their azimuths (G,), 0 to 1; how many sectors hold firmly
        enough against a translation that surfaces meet there; the sum of S p, S the stiffness and
        p the place as a translation; the sums of p^T S p and p^T g, and the mean square of p, by
        how firmly each holds.
    """
    away, turn, by_sector = np.empty(places.shape), np.empty(len(places)), np.zeros(SECTORS)
    grown, total, firm, pull, squares = np.zeros(6), 0.0, 0.0, 0.0, 0.0
    for g in range(len(places)):
        x = y = 0.0
        for i in range(3):
            away[g, i] = places[g, i] - sensor[i]
            x += away[g, i] * R[i, 0]
            y += away[g, i] * R[i, 1]
        turn[g] = np.arctan2(y, x) / (2.0 * np.pi) % 1.0
        weight = stiffness[g, 3, 3] + stiffness[g, 4, 4] + stiffness[g, 5, 5]
        by_sector[int(turn[g] * SECTORS) % SECTORS] += weight
        total += weight
        for j in range(3):
            p = away[g, j]
            pull += p * pulls[g, 3 + j]
            squares += weight * p * p
            for i in range(6):
                grown[i] += stiffness[g, i, 3 + j] * p
            for i in range(3):
                firm += away[g, i] * stiffness[g, 3 + i, 3 + j] * p
    sectors = 0
    for weight in by_sector:
        if weight > A_LITTLE * total / SECTORS:
            sectors += 1
    return away, turn, sectors, grown, (firm, pull, squares / total)


@kernel
def _over_time(
    pulls: Floats, stiffness: Floats, time: Floats, constrained: Twists
) -> tuple[Floats, Floats]:
    """Return matrix (2 k, 2 k) and gradient (2 k,) of observable motions and of their change.

    Over the time of each region: J^T S J and J^T g, J = [F, t F], F the motions (6, k).
    """
    sums, pull, k = np.zeros((3, 6, 6)), np.zeros((2, 6)), constrained.shape[1]
    for g in range(len(time)):
        for i in range(6):
            pull[0, i] += pulls[g, i]
            pull[1, i] += time[g] * pulls[g, i]
            for j in range(6):
                s = stiffness[g, i, j]
                sums[0, i, j] += s
                sums[1, i, j] += time[g] * s
                sums[2, i, j] += time[g] * time[g] * s
    matrix, gradient = np.zeros((2 * k, 2 * k)), np.zeros(2 * k)
    for m in range(2 * k):
        for i in range(6):
            along = constrained[i, m % k]
            gradient[m] += along * pull[m // k, i]
            for n in range(2 * k):
                for j in range(6):
                    matrix[m, n] += along * sums[m // k + n // k, i, j] * constrained[j, n % k]
    return matrix, gradient
