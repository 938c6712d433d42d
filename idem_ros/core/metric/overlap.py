"""How much of two clouds meets the other: of a scan in a map, what of the scan does."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Mask, Point, Points, RotationMatrix, Transform
from idem_ros.core.geometry import se3
from idem_ros.core.jit import kernel
from idem_ros.core.metric.cloud import Cloud

STRAYS = 0.005  # of the points at either end of each axis may be strays: no matter of the extent
WITHIN = 0.5  # of a cloud's points within the other's extent: with fewer it is a map to the other
DENSER = 5.0  # times as many there as the other has: a map, too, of what the other sees a part of


class Overlap(NamedTuple):
    """Shares of points that have a neighbour in the other cloud."""

    share: float  # of the points of both; where one is a map to the other, of the other's
    of_source: float  # of the source's points
    of_target: float  # of those of the target's points that lie within the source's extent
    most: float  # of all points of that cloud of which more do, never of a map's
    in_map: bool  # whether one of the two is a map to the other


def overlap_of(
    target: Cloud,
    source: Cloud,
    T_target_source: Transform,
    radius: float,
    reach: tuple[Floats, Floats],
) -> Overlap:
    """Return the `Overlap` of two clouds.

    How far a map goes on beyond the scan says nothing of how they agree, so that it is not
    counted. Exchanged clouds have the same share.

    Args:
        target, source: `Cloud`s; of a `MapPart` it is known that it is of a map.
        T_target_source: (4, 4), between the clouds' origins.
        radius: of the balls.
        reach: points of the other cloud in reach of the target's (N,) and of the source's (M,).
    """
    meets = reach[0] > 0.0, reach[1] > 0.0
    inside = _within_extent(target.points, source.points, se3.inverse(T_target_source), radius)
    of_source = float(meets[1].mean())
    of_target = float(meets[0][inside].mean()) if inside.any() else 0.0
    if target.is_part:
        return Overlap(of_source, of_source, of_target, of_source, in_map=True)
    back = _within_extent(source.points, target.points, T_target_source, radius)
    target_is_map, source_is_map = _is_map(inside, len(source)), _is_map(back, len(target))
    of_each = float(meets[0].mean()), of_source
    if target_is_map == source_is_map:
        both = float(np.concatenate(meets).mean())
        return Overlap(both, of_source, of_target, max(of_each), in_map=False)
    of_scan = of_each[1 if target_is_map else 0]
    return Overlap(of_scan, of_source, of_target, of_scan, in_map=True)


def _is_map(inside: Mask, others: int) -> bool:
    """Whether a cloud, of which some lie within the extent of another of so many, is a map."""
    return bool(inside.mean() < WITHIN or np.count_nonzero(inside) > DENSER * others)


def _within_extent(points: Points, others: Points, T: Transform, radius: float) -> Mask:
    """Return which points (N, 3) lie within a radius of the box of others, in the others' axes.

    T: (4, 4) takes the points to the others' frame.
    """
    last = len(others) - 1
    at = int(STRAYS * last), last - int(STRAYS * last)
    low, high = np.partition(others, at, axis=0)[[*at]]
    R, t = se3.rotation_and_translation(T)
    return _within(points, R, t, low - radius, high + radius)


@kernel
def _within(points: Points, R: RotationMatrix, t: Point, low: Point, high: Point) -> Mask:
    found = np.empty(points.shape[0], np.bool_)
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        is_in = True
        for c in range(3):
            place = R[c, 0] * x + R[c, 1] * y + R[c, 2] * z + t[c]
            is_in &= (low[c] <= place) & (place <= high[c])
        found[i] = is_in
    return found
