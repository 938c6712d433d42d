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
    RotationMatrix,
    Transform,
    Twist,
    Twists,
)
from idem_ros.core.geometry import se3
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


def told_by_residuals(
    regions: Regions, T: Transform, origin: Point, held: Twists, radius: float
) -> tuple[str, Matrix6]:
    """Say that residuals show a motion of the sweep, or a scale; and what that adds, (6, 6).

    Where a motion was not undone the pose is that of no instant: at the sweep's begin, or its
    end, the sensor was half of the motion away, which is added to the covariance of the twist
    (omega, v). Empty and zeros where they show nothing.

    Args:
        regions: of a result whose motion was not solved.
        T: (4, 4) the result, between the clouds' origins.
        origin: (3,) that of the source's cloud, in the sensor's frame.
        held: (6, k) motions that are observable.
        radius: of the last stage.
    """
    if held.shape[1] == 0:
        return '', np.zeros((6, 6))
    regions = regions._replace(places=regions.places - se3.transform_points(T, -origin))
    weight = np.einsum('gii->g', regions.stiffness[:, 3:, 3:])
    # what grows may seem to turn, too, what turns hardly grows
    if _is_growing(regions, weight, held, radius):
        return GROWING, np.zeros((6, 6))
    half = SHORT / 2 * _turning(regions, weight, T[:3, :3], held, radius)
    return TURNING if half.any() else '', np.outer(half, half)


def _turning(
    regions: Regions, weight: Floats, R: RotationMatrix, held: Twists, radius: float
) -> Twist:
    """Return by which motion residuals turn with azimuth, wherever a sweep begins; zeros: none.

    weight: (G,) how firmly regions hold against a translation.
    """
    x, y, _ = (regions.places @ R).T
    turn = np.arctan2(y, x) / (2.0 * np.pi) % 1.0
    firm = np.bincount((turn * SECTORS).astype(np.int64) % SECTORS, weight, SECTORS)
    if (firm > A_LITTLE * firm.mean()).sum() < ALL_AROUND:
        return np.zeros(6)
    found = [_between_ends(regions, (turn + seam) % 1.0 - 0.5, held, radius) for seam in SEAMS]
    most: Twist = held @ max(found, key=lambda motion: float(motion @ motion))
    return most


def _between_ends(regions: Regions, time: Floats, held: Twists, radius: float) -> Floats:
    """Return (k,) from Newton's pose at the sweep's begin to that at its end; zeros: not surely.

    The deviations are by what the regions still pull at the two.

    Args:
        regions: `Regions`.
        time: (G,) of the sweep, from -0.5 at its begin to 0.5.
        held: (6, k) motions.
        radius: of the last stage.
    """
    motion, squares = LEAST_TURNING
    k, share = held.shape[1], np.stack([np.ones(len(time)), time])
    weights = np.reshape(share[:, None] * share, (4, -1))
    sums = (weights @ regions.stiffness.reshape(-1, 36)).reshape(2, 2, 6, 6)
    matrix = (held.T @ sums @ held).transpose(0, 2, 1, 3).reshape(2 * k, 2 * k)
    step, _ = newton_step(matrix, (share @ regions.pulls @ held).reshape(-1))
    apart: Floats = step[k:]
    if np.linalg.norm(apart) < motion * radius:
        return np.zeros_like(apart)
    inverse = np.asarray(np.linalg.pinv(matrix, hermitian=True), np.float64)
    moved = share.T @ step.reshape(2, k) @ held.T
    left: Floats = regions.pulls + np.einsum('gij,gj->gi', regions.stiffness, moved)
    each = (share.T[:, :, None] * (left @ held)[:, None]).reshape(len(time), -1) @ inverse
    spread = (each.T @ each)[k:, k:]
    is_sure = apart @ np.linalg.pinv(spread, hermitian=True) @ apart >= k * squares
    return apart if is_sure else np.zeros_like(apart)


def _is_growing(regions: Regions, weight: Floats, held: Twists, radius: float) -> bool:
    """Whether residuals surely grow with range, as no motion of the whole undoes.

    A region is moved as one, outwards by a share of its range. The deviation is by what the
    regions still pull.

    weight: (G,) how firmly they hold against a translation.
    """
    pulls, stiffness, places, (motion, squares) = *regions[:3], LEAST_GROWING
    grown: Floats = np.einsum('gij,gj->gi', stiffness[:, :, 3:], places)
    of_all = held.T @ regions.total.matrix @ held
    undone, _ = newton_step(of_all, held.T @ grown.sum(axis=0))
    alone: Floats = np.tile(held @ undone, (len(places), 1))
    alone[:, 3:] += places
    firm = float((alone * grown).sum())
    if firm <= 0.0:
        return False
    scale = -float((alone * pulls).sum()) / firm
    reach = np.sqrt(weight @ (places**2).sum(axis=1) / weight.sum())
    if abs(scale) * reach < motion * radius:
        return False
    left: Floats = pulls + scale * np.einsum('gij,gj->gi', stiffness, alone)
    pulled: Floats = np.einsum('gi,gi->g', alone, left)
    return (scale * firm) ** 2 >= squares * float(pulled @ pulled)
