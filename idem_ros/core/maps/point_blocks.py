"""A map's points in memory, found by where they are."""

from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Floats, Indices, Integers, Integers32, Point, Points
from idem_ros.core.exceptions import InvalidCloud
from idem_ros.core.geometry.grid import bounds
from idem_ros.core.geometry.voxels import voxel_of
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.metric.measured_points import checked_points, finite_points

FIRST_SLOTS = 1 << 12
FULL = 0.5  # of the slots


class PointBlocks:
    """Points kept in memory as the `BlockSource` of a map.

    They are sorted into cubes when first asked for, of the edge first asked for: an order, 4 bytes
    a point, beside the 24 of the points.

    Args:
        points: (N, 3) real numbers, N >= 1, in any unit of length; they are copied. Rows that are
            not finite, masked, or beyond 1e12, count in `dropped` and are left out.

    Attributes:
        dropped: how many points are left out.

    Raises:
        InvalidCloud: another shape, not numbers, or no finite point.
    """

    def __init__(self, points: ArrayLike) -> None:
        finite, self._points = finite_points(checked_points(points))
        if len(self._points) == 0:
            raise InvalidCloud(
                f'the map has {len(finite)} points and none is finite; at least one must be'
            )
        self.dropped = len(finite) - len(self._points)
        self._bounds = np.array(bounds(self._points))
        self._cubes: _Cubes | None = None
        self._lock = Lock()

    def __len__(self) -> int:
        return len(self._points)

    @property
    def bounds(self) -> Floats:
        """The lowest and highest coordinates (2, 3)."""
        return self._bounds

    def points_within(self, low: Point, high: Point) -> Points:
        """Return the points (N, 3) with low <= p < high, in the order they were given."""
        with self._lock:
            if self._cubes is None:
                self._cubes = _in_cubes(self._points, float((high - low).max()))
        some = self._cubes.within(low, high)
        points = self._points[np.sort(some)]
        return points[((points >= low) & (points < high)).all(axis=1)]


class _Cubes(NamedTuple):
    """Indices of points, one cube's after another's."""

    edge: float
    number: dict[tuple[int, ...], int]  # of the cube at (i, j, k) edges
    corner: Integers  # (M, 3): (i, j, k) of each
    start: Integers  # (M + 1,)
    order: Indices  # (N,)

    def within(self, low: Point, high: Point) -> Indices:
        """Return the indices of the points of all cubes that a box touches."""
        first, last = _corners(np.array([low, np.nextafter(high, -np.inf)]), self.edge)
        if np.prod((last - first + 1).astype(float)) < len(self.corner):
            x, y, z = (range(a, b + 1) for a, b in zip(first, last, strict=True))
            corners = ((i, j, k) for k in z for j in y for i in x)
            met = [n for corner in corners if (n := self.number.get(corner)) is not None]
        else:
            touched = (self.corner >= first) & (self.corner <= last)
            met = np.flatnonzero(touched.all(axis=1)).tolist()
        return np.concatenate(
            [np.empty(0, np.int32), *(self.order[self.start[n] : self.start[n + 1]] for n in met)]
        )


def _in_cubes(points: Points, edge: float) -> _Cubes:
    slots = FIRST_SLOTS
    number, corner = np.empty(len(points), np.int32), np.empty((len(points), 3), np.int64)
    while (n := _number(points, edge, np.full(slots, -1, np.int32), corner, number)) < 0:
        slots *= 2
    start, order = _sorted(number, n)
    corner = corner[:n].copy()
    return _Cubes(edge, {tuple(c): i for i, c in enumerate(corner.tolist())}, corner, start, order)


def _corners(points: Points, edge: float) -> Integers:
    """Return (i, j, k) of the cubes that points lie in: i * edge <= x < (i + 1) * edge."""
    corner = np.empty(points.shape, np.int64)
    _fill_corners(points, edge, corner)
    return corner


@kernel
def _fill_corners(points: Points, edge: float, corner: Integers) -> None:
    for i in range(points.shape[0]):
        for c in range(3):
            corner[i, c] = _below(points[i, c], edge)


@inlined
def _below(x: float, edge: float) -> int:
    """Return the whole i with i * edge <= x < (i + 1) * edge, as these products are rounded."""
    i = np.int64(np.floor(x / edge))
    if x < i * edge:
        i -= 1
    elif x >= (i + 1) * edge:
        i += 1
    return i  # pyright: ignore[reportReturnType]  # of which NumPy tells less


@kernel
def _number(
    points: Points, edge: float, slots: Integers32, corner: Integers, number: Integers32
) -> int:
    """Fill the number of each point's cube, and the cubes' corners; return how many there are.

    -1 where there are too few slots.
    """
    n, mask, most = 0, slots.shape[0] - 1, FULL * slots.shape[0]
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        v = voxel_of(_below(x, edge), _below(y, edge), _below(z, edge), slots, mask, corner, n)
        n += v == n
        if n > most:
            return -1
        number[i] = v
    return n


@kernel
def _sorted(number: Integers32, n: int) -> tuple[Integers, Integers32]:
    """Return where each cube's points begin, and all points by cube, each's in their order."""
    start, order = np.zeros(n + 2, np.int64), np.empty(number.shape[0], np.int32)
    for v in number:
        start[v + 2] += 1
    for v in range(2, n + 2):
        start[v] += start[v - 1]
    for i in range(number.shape[0]):
        at = number[i] + 1
        order[start[at]] = i
        start[at] += 1
    return start[:-1], order
