"""What of a map a scan can reach: a cloud, put together from the map's blocks."""

from __future__ import annotations

import numpy as np

from idem_ros.core.arrays import Indices, Point, Points, Transform, Weights
from idem_ros.core.blocks import ALONE, Workers, in_threads
from idem_ros.core.geometry import se3
from idem_ros.core.maps.map_blocks import BlockMoments, Index, Level, MapBlocks
from idem_ros.core.maps.reach import Reach, rows_in_reach
from idem_ros.core.metric.cloud import Cloud, Neighbourhoods
from idem_ros.core.metric.moments import AS_MEASURED

KEPT = 4  # results of each kind: a schedule's


class MapPart(Cloud):
    """The points or voxels of a map within a `Reach`, with the moments they have in the whole map.

    A `Cloud` like any other; `reduced` and the moments come from the map's blocks, as they were
    prepared or are now.

    Args:
        blocks: `MapBlocks`.
        level: the `Level` of its points.
        reach: `Reach`, of blocks of the same edge.
        origin: (3,) that its points are told from.
        workers: for blocks that are yet to be prepared.

    Raises:
        OutOfTime: the workers are late.
    """

    def __init__(
        self, blocks: MapBlocks, level: Level, reach: Reach, origin: Point, workers: Workers
    ) -> None:
        self._blocks, self._level, self.reach = blocks, level, reach
        self._rows: list[tuple[Index, Indices]] = []
        blocks.asked_for(level)
        points, weights = self._gathered(workers, origin)
        self._init(origin, np.ones(len(points), bool), points, weights, KEPT)

    @property
    def is_part(self) -> bool:
        """Whether more of the map lies beside it: yes."""
        return True

    def reaches(self, source: Cloud, T: Transform) -> bool:
        """Whether all that a source can meet is in it; T: (4, 4), between the clouds' origins."""
        points = se3.transform_points(T, source.points) + self.origin
        return self.reach.holds(points, rings=1)

    def _gathered(self, workers: Workers, origin: Point) -> tuple[Points, Weights]:
        level, masks = self._level, self.reach.by_block()
        found = in_threads(workers, lambda index: self._blocks.points(level, index), [*masks])
        points, weights = [np.empty((0, 3))], [np.empty((0, 7))]
        for (index, cubes), block in zip(masks.items(), found, strict=True):
            rows = rows_in_reach(block.points, level.edge, cubes)
            if len(rows):
                self._rows.append((index, rows))
                points.append(block.points.take(rows, axis=0) + (level.corner(index) - origin))
                if level.voxel_size is not None:
                    weights.append(block.weights.take(rows, axis=0))
        measured = level.voxel_size is None
        return np.concatenate(points), AS_MEASURED if measured else np.concatenate(weights)

    def reduced(self, voxel_size: float) -> Cloud:
        """Return the map's voxels in the same reach; itself, where it is made of them."""
        if voxel_size == self._level.voxel_size:
            return self
        level = self._level._replace(voxel_size=voxel_size)
        return self._kept.get(
            'reduced',
            voxel_size,
            lambda: MapPart(self._blocks, level, self.reach, self.origin, ALONE),
        )

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
