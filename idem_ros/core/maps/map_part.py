"""What of a map a scan can reach: a cloud, put together from the map's blocks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Indices, Point, Points, Transform, Weights
from idem_ros.core.geometry import se3
from idem_ros.core.jit import kernel
from idem_ros.core.maps.map_blocks import BlockPoints, Index, Level, MapBlocks
from idem_ros.core.maps.reach import Reach, rows_in_reach
from idem_ros.core.metric.candidates import farthest_moved
from idem_ros.core.metric.cloud import Cloud, Neighbourhoods
from idem_ros.core.metric.moments import AS_MEASURED
from idem_ros.core.workers import ALONE, Workers, in_threads

KEPT = 4  # results of each kind: a schedule's
SKIN = 1.1  # of the radius: candidates are looked for so far


class Place(NamedTuple):
    """Where a scan is in a map."""

    reach: Reach  # of its points there
    T: Transform  # between the origins of part and scan
    origin: Point  # (3,) in the map: of the part
    wider: float  # how far beyond the scan's points coarse stages may look
    moves: float  # how far the scan may move before another part is asked for


class MapPart(Cloud):
    """The points or voxels of a map in reach of a scan, with the moments they have in the map.

    A `Cloud` like any other; `reduced` and the moments come from the map's blocks, as they were
    prepared or are now.

    Args:
        blocks: `MapBlocks`.
        level: the `Level` of its points.
        place: `Place` of the scan.
        workers: for blocks that are yet to be prepared.

    Raises:
        OutOfTime: the workers are late.
    """

    def __init__(self, blocks: MapBlocks, level: Level, place: Place, workers: Workers) -> None:
        self._blocks, self._level, self._place = blocks, level, place
        self._rows: list[_Rows] = []
        self._moved: MapPart | None = None
        # what follows may be made within other threads' work, which waits for none
        self._workers = workers._replace(threads=1)
        blocks.asked_for(level)
        points, weights = self._gathered(workers)
        self._init(place.origin, np.ones(len(points), bool), points, weights, KEPT)

    @property
    def is_part(self) -> bool:
        """Whether more of the map lies beside it: yes."""
        return True

    def around(
        self, source: Cloud, T: Transform, radius: float, workers: Workers = ALONE
    ) -> MapPart:
        """Return the part that a source can reach at T, (4, 4) between the clouds' origins.

        Itself, or the one returned last, as long as the source has not moved far from there.

        Raises:
            OutOfTime: the workers are late.
        """
        self._workers = workers._replace(threads=1)
        for part in (self, self._moved):
            if part is not None:
                left = part._place.reach.distance - SKIN * radius
                moved = np.sqrt(farthest_moved(T, part._place.T, source.bounds()))
                if moved <= left:
                    part._workers = self._workers
                    return part
        points = se3.transform_points(T, source.points) + self.origin
        distance, bounds = self._place.moves + SKIN * radius, self._blocks.source.bounds
        reach = Reach.around(points, self._level.edge, distance, bounds)
        place = self._place._replace(reach=reach, T=T)
        there = MapPart(self._blocks, self._level, place, workers)
        if len(there) == 0:  # it has left the map
            return self
        self._moved = there
        return there

    def reduced(self, voxel_size: float) -> Cloud:
        """Return the map's voxels in reach, farther than its own; itself, where it is of them."""
        if voxel_size == self._level.voxel_size:
            return self
        return self._kept.get('reduced', voxel_size, lambda: self._reduced(voxel_size))

    def _reduced(self, voxel_size: float) -> Cloud:
        level = self._level._replace(voxel_size=voxel_size)
        reach = self._kept.get('wider', None, lambda: self._place.reach.wider(self._place.wider))
        return MapPart(self._blocks, level, self._place._replace(reach=reach), self._workers)

    def _gathered(self, workers: Workers) -> tuple[Points, Weights]:
        """Return the points in reach and their weights; remember which rows of blocks they are."""
        level, reach, origin = self._level, self._place.reach, self._place.origin
        indices, numbers = reach.by_block()
        found = in_threads(workers, lambda index: self._blocks.points(level, index), indices)
        n = 0
        for index, in_reach, block in zip(indices, numbers, found, strict=True):
            if len(block.points) == 0:
                continue
            cubes = np.zeros(reach.per_edge**3, np.bool_)
            cubes[in_reach] = True
            rows = rows_in_reach(block.points, level.edge, reach.per_edge, cubes)
            if len(rows):
                self._rows.append(_Rows(index, rows, n, block))
                n += len(rows)
        points = np.empty((n, 3))
        weights = AS_MEASURED if level.voxel_size is None else np.empty((n, 7))
        for each in self._rows:
            to = np.arange(each.begin, each.begin + len(each.rows), dtype=np.int32)
            put_rows(each.block.points, each.rows, points, to)
            points[each.begin : each.begin + len(to)] += level.corner(each.of) - origin
            if level.voxel_size is not None:
                put_rows(each.block.weights, each.rows, weights, to)
        return points, weights

    def ready_neighbourhoods(self, radius: float, workers: Workers) -> Neighbourhoods | None:
        """Return the `Neighbourhoods` at a radius, of the moments that the blocks have.

        None where balls are wider than a block, as garbage makes them: they would hold the map.
        """
        if radius > self._level.edge:
            return None
        cells = self.in_cells(radius)
        self._blocks.asked_for(self._level, radius)
        place = np.empty(len(cells.order), np.int32)  # of each point in the order of the cells
        place[cells.order] = np.arange(len(place), dtype=np.int32)
        unit = np.empty((len(place), 10))
        own = np.empty_like(unit) if self.is_reduced else unit

        def put(each: _Rows) -> None:
            """Put the moments of those of a block's balls that are in reach where they belong."""
            of_block = self._blocks.moments(self._level, radius, each.of)
            to = place[each.begin : each.begin + len(each.rows)]
            put_rows(of_block.unit, each.rows, unit, to)
            if self.is_reduced:
                put_rows(of_block.own, each.rows, own, to)

        in_threads(workers, put, self._rows)
        return Neighbourhoods(*cells, unit, own)


class _Rows(NamedTuple):
    """Which of a block's points are in reach."""

    of: Index
    rows: Indices  # of the block's
    begin: int  # where they begin in the part
    block: BlockPoints


@kernel
def put_rows(array: Floats, rows: Indices, out: Floats, to: Indices) -> None:
    """Fill out[to[i]] with array[rows[i]], arrays (N, k) and (M, k)."""
    for i in range(rows.shape[0]):
        a, b = array[rows[i]], out[to[i]]
        for c in range(array.shape[1]):
            b[c] = a[c]
