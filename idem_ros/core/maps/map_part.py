"""What of a map a scan can reach: a cloud, put together from the map's blocks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Indices, Point, Points, Transform, Weights
from idem_ros.core.blocks import ALONE, Workers, in_threads
from idem_ros.core.geometry import se3
from idem_ros.core.maps.map_blocks import BlockMoments, Index, Level, MapBlocks
from idem_ros.core.maps.reach import Reach, rows_in_reach
from idem_ros.core.metric.candidates import farthest_moved
from idem_ros.core.metric.cloud import Cloud, Neighbourhoods
from idem_ros.core.metric.moments import AS_MEASURED

KEPT = 4  # results of each kind: a schedule's
MOVED = 0.5  # of a cube: a scan that has moved farther may meet what is not in reach


class Place(NamedTuple):
    """Where a scan is in a map."""

    reach: Reach  # of its points there
    T: Transform  # between the origins of part and scan
    origin: Point  # (3,) in the map: of the part
    wider: float  # how far beyond the scan's points coarse stages may look


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
        self._rows: list[tuple[Index, Indices]] = []
        self._moved: MapPart | None = None
        blocks.asked_for(level)
        points, weights = self._gathered(workers)
        self._init(place.origin, np.ones(len(points), bool), points, weights, KEPT)

    @property
    def is_part(self) -> bool:
        """Whether more of the map lies beside it: yes."""
        return True

    def around(self, source: Cloud, T: Transform) -> MapPart:
        """Return the part that a source can reach at T, (4, 4) between the clouds' origins.

        Itself, or the one returned last, as long as the source has not moved far from there.
        """
        for part in (self, self._moved):
            if part is not None:
                most = MOVED * part._place.reach.cube
                if farthest_moved(T, part._place.T, source.bounds()) <= most**2:
                    return part
        points = se3.transform_points(T, source.points) + self.origin
        reach = Reach.around(points, self._level.edge)
        place = self._place._replace(reach=reach, T=T)
        moved = MapPart(self._blocks, self._level, place, ALONE)
        self._moved = moved if len(moved) else self  # it has left the map
        return self._moved

    def reduced(self, voxel_size: float) -> Cloud:
        """Return the map's voxels in reach, farther than its own; itself, where it is of them."""
        if voxel_size == self._level.voxel_size:
            return self
        return self._kept.get('reduced', voxel_size, lambda: self._reduced(voxel_size))

    def _reduced(self, voxel_size: float) -> Cloud:
        level = self._level._replace(voxel_size=voxel_size)
        reach = self._kept.get('wider', None, lambda: self._place.reach.wider(self._place.wider))
        return MapPart(self._blocks, level, self._place._replace(reach=reach), ALONE)

    def _gathered(self, workers: Workers) -> tuple[Points, Weights]:
        level, reach, origin = self._level, self._place.reach, self._place.origin
        indices, masks = reach.by_block()
        found = in_threads(workers, lambda index: self._blocks.points(level, index), indices)
        points, weights = [np.empty((0, 3))], [np.empty((0, 7))]
        for index, cubes, block in zip(indices, masks, found, strict=True):
            rows = rows_in_reach(block.points, level.edge, reach.per_edge, cubes)
            if len(rows):
                self._rows.append((index, rows))
                points.append(block.points.take(rows, axis=0) + (level.corner(index) - origin))
                if level.voxel_size is not None:
                    weights.append(block.weights.take(rows, axis=0))
        measured = level.voxel_size is None
        return np.concatenate(points), AS_MEASURED if measured else np.concatenate(weights)

    def ready_neighbourhoods(self, radius: float, workers: Workers) -> Neighbourhoods:
        """Return the `Neighbourhoods` at a radius, of the moments that the blocks have."""
        cells = self.in_cells(radius)
        self._blocks.asked_for(self._level, radius)

        def moments(of_block: tuple[Index, Indices]) -> BlockMoments:
            """Return the moments of those of a block's balls that are in reach."""
            index, rows = of_block
            unit, own = self._blocks.moments(self._level, radius, index)
            some = unit.take(rows, axis=0)
            return BlockMoments(some, some if own is unit else own.take(rows, axis=0))

        found = in_threads(workers, moments, self._rows)
        unit = np.concatenate([each.unit for each in found]).take(cells.order, axis=0)
        if not self.is_reduced:
            return Neighbourhoods(*cells, unit, unit)
        own = np.concatenate([each.own for each in found]).take(cells.order, axis=0)
        return Neighbourhoods(*cells, unit, own)
