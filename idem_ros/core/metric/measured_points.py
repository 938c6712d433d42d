"""Points as they were measured: checked, the finite ones kept, moved to their middle."""

from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from idem_ros.core.arrays import Floats, Mask, Point, Points
from idem_ros.core.exceptions import InvalidCloud, InvalidConfig
from idem_ros.core.geometry.grid import bounds
from idem_ros.core.jit import kernel

FARTHEST = 1e12  # a coordinate beyond is no measurement, and would drown the others' digits
FINEST = 2.0**24  # voxels from the middle outwards: float32 tells no finer ones apart
MIDDLE_SAMPLE = 64  # points, about, that tell the middle or the extent of a cloud
# A stray: so many times as far from the middle as nine tenths of the points, or as half of them.
# A street that is seen from within a cage, or through a window, is nearer.
BEYOND_MOST, BEYOND_HALF = 30.0, 1000.0
BEYOND_USUAL = 10.0  # times as far as three quarters
FEWEST, SAMPLE = 64, 1000  # points that tell how far the others are, and of which they are


def centred_points(points: ArrayLike) -> tuple[Point, Mask, Points]:
    """Return the middle (3,) of a cloud, which rows (N,) are finite, and these rows about it.

    Raises:
        InvalidCloud: no array of points, or none is finite.
    """
    points = checked_points(points)
    finite, kept = finite_points(points)
    if len(kept) == 0:
        raise InvalidCloud(
            f'the cloud has {len(points)} points and none is finite; at least one must be'
        )
    # Moments are taken near the origin: at map coordinates (1e6 m) their digits would cancel. The
    # median of a sample: a stray would drag the mean away, and with it the others' digits.
    sample = np.sort(kept[:: max(len(kept) // MIDDLE_SAMPLE, 1)], axis=0)
    origin = sample[len(sample) // 2].copy()
    for axis in range(3):  # numpy takes a column at a time three times faster than rows of three
        kept[:, axis] -= origin[axis]
    near = near_the_rest(kept, np.zeros(3))
    if not near.all():
        finite[finite] = near
        kept = kept[near]
    return origin, finite, kept


def near_the_rest(points: Points, middle: Point | None = None) -> Mask:
    """Return (N,) bool: which of finite points (N, 3) are no strays, of which there are a few.

    Not what is 30 times as far from the middle, along any axis, as nine tenths of the points are,
    or 1000 times as far as half of those elsewhere. Fewer than 64 points have no strays.

    middle: (3,); None: the median.
    """
    if len(points) < FEWEST:
        return np.ones(len(points), bool)
    few = points[:: max(len(points) // SAMPLE, 1)]
    middle = np.median(few, axis=0) if middle is None else middle
    half, most = far_from(few - middle, 0.5, 0.9)
    limit = min(BEYOND_HALF * half, BEYOND_MOST * most) or np.inf
    low, high = bounds(points)
    if (low >= middle - limit).all() and (high <= middle + limit).all():
        return np.ones(len(points), bool)
    far: Floats = np.abs(points - middle).max(axis=1)
    return far <= limit


def far_from(points: Points, *shares: float) -> list[float]:
    """Return how far along any axis shares of points (N, 3) are at most, but for those at 0."""
    x, y, z = np.abs(points).T  # numpy takes the most of columns sooner than that of rows
    far = np.maximum(np.maximum(x, y), z)
    far = np.sort(far[far > 0.0])
    return [float(far[int(share * len(far))]) if len(far) else 0.0 for share in shares]


def usual(points: Points) -> Points:
    """Return what of points (N, 3) about their middle tells how far they reach, and where.

    Not what is 10 times as far along any axis as three quarters are: it may be true, yet is so
    little that it should not outweigh the others.
    """
    if len(points) < FEWEST:
        return points
    (upper_quartile,) = far_from(points[:: max(len(points) // SAMPLE, 1)], 0.75)
    limit = BEYOND_USUAL * upper_quartile or np.inf
    low, high = bounds(points)
    if (low >= -limit).all() and (high <= limit).all():
        return points
    return points[(np.abs(points) <= limit).all(axis=1)]


@kernel
def mean_and_variance(points: Points) -> tuple[Point, float]:
    """Return the mean of (N, 3) points, and their mean squared distance from it."""
    mean, square, n = np.zeros(3), 0.0, points.shape[0]
    for i in range(n):
        for k in range(3):
            mean[k] += points[i, k]
    mean /= n
    for i in range(n):
        for k in range(3):
            square += (points[i, k] - mean[k]) ** 2
    return mean, square / n


def checked_points(points: Any) -> Points:
    """Return (N, 3) float64, with NaN where points are masked.

    Raises:
        InvalidCloud: they have another shape, or are not numbers.
    """
    try:
        masked = isinstance(points, np.ma.MaskedArray)
        array: NDArray[Any] = (
            cast(Any, points).astype(np.float64).filled(np.nan) if masked else np.asarray(points)
        )
        if array.dtype.kind not in 'fiub':
            raise TypeError(f'its dtype is {array.dtype}')
    except (TypeError, ValueError) as error:
        raise InvalidCloud(f'the cloud is not an array of real numbers: {error}') from error
    if array.ndim != 2 or array.shape[1] != 3:
        more = ', as points[:, :3] is' if array.ndim == 2 and array.shape[1] > 3 else ''
        more = ', as points.T is' if array.ndim == 2 and array.shape[0] == 3 else more
        raise InvalidCloud(f'the cloud has shape {array.shape}; it must be (N, 3){more}')
    return np.ascontiguousarray(array, dtype=np.float64)


@kernel
def finite_points(points: Points) -> tuple[Mask, Points]:
    """Return which rows are finite and no farther than any measurement, and these rows."""
    finite, kept = np.empty(points.shape[0], np.bool_), np.empty(points.shape)
    n = 0
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        finite[i] = abs(x) < FARTHEST and abs(y) < FARTHEST and abs(z) < FARTHEST
        kept[n, 0], kept[n, 1], kept[n, 2] = x, y, z  # the next takes the place of what is not
        n += finite[i]
    return finite, kept[:n]


def require_resolved(points: Points, voxel_size: float) -> None:
    """Refuse voxels finer than single precision resolves the extent of (N, 3) points about 0.

    Raises:
        InvalidConfig: it says how large they must be.
    """
    # half of the points: a stray, however far, says nothing of the extent
    sample = points[:: max(len(points) // MIDDLE_SAMPLE, 1)]
    extent = float(np.median(np.abs(sample).max(axis=1)))
    if extent / voxel_size > FINEST:
        raise InvalidConfig(
            f'voxel_size is {voxel_size:g}, but the cloud reaches {extent:.3g} from its middle: '
            f'it must be {extent / FINEST:.1g} at least, or none'
        )
