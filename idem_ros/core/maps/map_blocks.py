"""The blocks of a map: cubes whose points, voxels and own moments are made when first reached.

What a block holds is a matter of the points in it, and for the moments of those within a radius
around it: the same bits whenever it is made, and whatever else the map holds.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from itertools import product
from threading import Lock
from typing import Any, NamedTuple, Protocol, TypeAlias, TypeVar

import numpy as np

from idem_ros.core.arrays import Floats, Indices, Integer, MomentRows, Point, Points, Weights
from idem_ros.core.geometry.grid import CELL_MARGIN, build_grid_between
from idem_ros.core.geometry.voxels import reduce_to_voxels
from idem_ros.core.jit import kernel
from idem_ros.core.metric.moments import AS_MEASURED, TIE, moments_around

Value = TypeVar('Value', bound=tuple[Any, ...])
EACH = 300  # bytes of an entry beside its arrays, about
MOST_ASKED = 24  # kinds of voxels and radii that blocks are prepared for ahead: a few schedules
MOST_CELLS = 1 << 18  # of a block's grid: its table then fits in a core's cache
Index: TypeAlias = tuple[Integer, Integer, Integer]  # of a block, in edges from the map's zero
NO_WEIGHTS: Weights = np.empty((0, 7))


class BlockSource(Protocol):
    """A map's points by where they are: tiles on disk, an array in memory, a formula.

    A `MapCloud` asks for cubes, keeps what it makes of them, and asks again for what it has let go
    of; from two threads at once, where it prepares ahead.
    """

    @property
    def bounds(self) -> Floats:
        """The lowest and highest coordinates, (2, 3), of all points or farther out."""
        ...

    def points_within(self, low: Point, high: Point, /) -> Points:
        """Return all points (N, 3), float64 and finite, with low <= p < high along each axis.

        In an order that is always the same; none, (0, 3), where there is nothing. What lies
        elsewhere should cost nothing.
        """
        ...


class Latest:
    """Tuples of arrays, by a key; the least lately asked for are let go of; threads may share it.

    Args:
        most_bytes: of the arrays, about; what is in use may be more.
    """

    def __init__(self, most_bytes: int) -> None:
        self.most_bytes = most_bytes
        self.bytes = self.made = 0  # bytes that are kept, and that ever were
        self._kept: OrderedDict[Hashable, tuple[Any, ...]] = OrderedDict()
        self._lock = Lock()

    def get(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return what is kept, or what make returns: made outside the lock, always the same."""
        with self._lock:
            if (kept := self._kept.get(key)) is not None:
                self._kept.move_to_end(key)
                return kept  # pyright: ignore[reportReturnType]  # what make returned under it
        value = make()
        with self._lock:
            if key not in self._kept:
                self._kept[key] = value
                self.bytes += _size(value)
                self.made += _size(value)
            while self.bytes > self.most_bytes and len(self._kept) > 1:
                self.bytes -= _size(self._kept.popitem(last=False)[1])
        return value

    def has(self, key: Hashable) -> bool:
        """Whether it is kept; asks for nothing."""
        with self._lock:
            return key in self._kept


def _size(value: tuple[Any, ...]) -> int:
    arrays = {id(each): int(each.nbytes) for each in value}  # one may stand twice
    return EACH + sum(arrays.values())


class Level(NamedTuple):
    """Voxels that a map is looked at in."""

    edge: float  # of the blocks
    finest: float | None  # voxels made of points; None: points as given
    voxel_size: float | None  # voxels made of those; the same, where these are them

    def corner(self, index: Index) -> Point:
        """Return the lowest corner of a block (3,)."""
        return np.array(index) * self.edge


class BlockPoints(NamedTuple):
    """A block's points, or voxels."""

    points: Points  # (n, 3), from the block's corner
    weights: Weights  # (n, 7) weight and scatter; (1, 7): of each


class BlockMoments(NamedTuple):
    """Of the ball around each of a block's points in the whole map."""

    unit: MomentRows  # (n, 10), each point counting once
    own: MomentRows  # (n, 10), with weight and scatter; the same array where all have one and none


NOTHING = BlockPoints(np.empty((0, 3)), NO_WEIGHTS)


class MapBlocks:
    """A source's blocks, and what was made of them lately.

    Args:
        source: a `BlockSource`.
        most_bytes: that are kept.
    """

    def __init__(self, source: BlockSource, most_bytes: int) -> None:
        self.source = source
        self._latest = Latest(most_bytes)
        self._asked: dict[tuple[Level, float | None], None] = {}  # latest last
        self._lock = Lock()

    @property
    def bytes(self) -> int:
        """How much is kept."""
        return self._latest.bytes

    def points(self, level: Level, index: Index) -> BlockPoints:
        """Return a block's points or voxels."""
        return self._latest.get((level, index), lambda: self._points(level, index))

    def moments(self, level: Level, radius: float, index: Index) -> BlockMoments:
        """Return the moments of the balls of a radius around a block's points."""
        key = level, radius, index
        return self._latest.get(key, lambda: self._moments(level, radius, index))

    def asked_for(self, level: Level, radius: float | None = None) -> None:
        """Remember that voxels, or their moments at a radius, are what scans ask for."""
        with self._lock:
            self._asked.pop((level, radius), None)
            self._asked[level, radius] = None
            while len(self._asked) > MOST_ASKED:
                self._asked.pop(next(iter(self._asked)))

    def prepared_around(self, center: Point, reach: float) -> Iterator[Index]:
        """Prepare what scans asked for lately in the blocks around a place, the nearest first.

        Yields the index of a block for each kind that is prepared of it now, until half of what is
        kept would be new.
        """
        with self._lock:
            asked = [*self._asked][::-1]
        most = self._latest.made + self._latest.most_bytes // 2
        for edge in dict.fromkeys(level.edge for level, _ in asked):
            wanted = [each for each in asked if each[0].edge == edge]
            for index in self._around(center, reach, edge):
                new = [each for each in wanted if not self._has(*each, index)]
                for level, radius in new:
                    if radius is None:
                        self.points(level, index)
                    else:
                        self.moments(level, radius, index)
                    if self._latest.made > most:
                        return
                    yield index

    def _has(self, level: Level, radius: float | None, index: Index) -> bool:
        key = (level, index) if radius is None else (level, radius, index)
        return self._latest.has(key)

    def _around(self, center: Point, reach: float, edge: float) -> list[Index]:
        low, high = self.source.bounds
        first = np.floor(np.maximum(center - reach, low) / edge).astype(int)
        last = np.floor(np.minimum(center + reach, high) / edge).astype(int)
        x, y, z = (range(a, b + 1) for a, b in zip(first.tolist(), last.tolist(), strict=True))
        found = product(x, y, z)
        return sorted(
            found, key=lambda index: float(np.sum(((np.array(index) + 0.5) * edge - center) ** 2))
        )

    def _points(self, level: Level, index: Index) -> BlockPoints:
        if level.voxel_size == level.finest:
            corner = level.corner(index)
            given = self.source.points_within(corner, level.corner(_next(index)))
            points, weights = np.ascontiguousarray(given, dtype=np.float64) - corner, AS_MEASURED
        else:
            points, weights = self.points(level._replace(voxel_size=level.finest), index)
        if len(points) == 0:
            return NOTHING
        if level.voxel_size is None:
            return BlockPoints(points, weights)
        return BlockPoints(*reduce_to_voxels(points, weights, level.voxel_size, np.zeros(3)))

    def _moments(self, level: Level, radius: float, index: Index) -> BlockMoments:
        block = self.points(level, index)
        n = len(block.points)
        unit = np.empty((n, 10))
        own = np.empty((n, 10)) if level.voxel_size is not None else unit
        if n:
            points, weights = self._with_neighbours(level, radius, index, block)
            cell = radius * CELL_MARGIN
            box = np.full(3, -cell), np.full(3, level.edge + cell)
            grid, order = build_grid_between(points, cell, box, MOST_CELLS)
            weights = weights if level.voxel_size is None else weights.take(order, axis=0)
            moments_around(block.points, grid, weights, radius * radius * TIE, unit, own)
        return BlockMoments(unit, own)

    def _with_neighbours(
        self, level: Level, radius: float, index: Index, block: BlockPoints
    ) -> tuple[Points, Weights]:
        """Return a block's points, and those of the blocks around it within a radius of it."""
        low, high = block.points.min(axis=0) - radius, block.points.max(axis=0) + radius
        first, last = np.floor(low / level.edge), np.floor(high / level.edge)
        points, weights = [block.points], [block.weights]
        for step in product(
            *(range(int(a), int(b) + 1) for a, b in zip(first, last, strict=True))
        ):
            if step == (0, 0, 0):
                continue
            other = self.points(
                level, (index[0] + step[0], index[1] + step[1], index[2] + step[2])
            )
            near, moved = _moved_between(other.points, np.array(step) * level.edge, low, high)
            points.append(moved)
            weights.append(other.weights[near] if level.voxel_size is not None else NO_WEIGHTS)
        return np.concatenate(points), np.concatenate(weights)


@kernel
def _moved_between(points: Points, step: Point, low: Point, high: Point) -> tuple[Indices, Points]:
    """Return the rows of points that lie in a box when they are moved, and these moved."""
    rows, n = np.empty(points.shape[0], np.int32), 0
    for i in range(points.shape[0]):
        x, y, z = points[i, 0] + step[0], points[i, 1] + step[1], points[i, 2] + step[2]
        is_inside = low[0] <= x <= high[0] and low[1] <= y <= high[1] and low[2] <= z <= high[2]
        rows[n] = i  # kept only if it is counted
        n += np.int64(is_inside)
    rows = rows[:n].copy()
    moved = np.empty((n, 3))
    for k in range(n):
        for axis in range(3):
            moved[k, axis] = points[rows[k], axis] + step[axis]
    return rows, moved


def _next(index: Index) -> Index:
    return index[0] + 1, index[1] + 1, index[2] + 1
