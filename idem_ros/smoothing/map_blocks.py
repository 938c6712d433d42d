"""A map of keyframes, and how consistent it is: block by block, on disk until then."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from idem_ros.core.geometry.se3 import transform_points
from idem_ros.core.geometry.voxels import reduce_to_voxels
from idem_ros.core.metric.moments import AS_MEASURED
from idem_ros.files.atomic_file import UnwritableFile
from idem_ros.smoothing.consistency import (
    Consistency,
    MapRows,
    consistency_of,
    entropy_of,
    merged,
)

CELLS = 32  # of a block along x and y
CELL = 2  # voxels of a cell, along each axis: some of every scan lie in one
BALL = 2.0  # voxels: radius of the balls of the mean map entropy
COLUMNS = 11  # of a row on disk: scan, mean, points, scatter
MOST_ROWS = 500_000  # at once; of a block with more a part is read after the other
UPPER = [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]


@dataclass(frozen=True)
class Part:
    """A part of a map."""

    points: np.ndarray
    """(N, 3): of each voxel the mean of all points."""
    consistency: Consistency


class MapBlocks:
    """Voxels of scans, in the blocks of a lattice that they lie in.

    Args:
        folder: `Path`, empty.
        voxel_size: [m].
    """

    def __init__(self, folder, voxel_size):
        self._folder, self._voxel_size = Path(folder), voxel_size
        self._edge = CELLS * CELL * voxel_size
        self.blocks = set()
        self._along = []  # of each scan, how far along the way

    def add(self, points, pose, along):
        """Take the points of a scan.

        Args:
            points: (N, 3), in its own frame.
            pose: (4, 4).
            along: how far along its way the sensor was [m].

        Raises:
            UnwritableFile: the disk is full.
        """
        rows = _rows(points, pose, self._voxel_size, len(self._along))
        self._along.append(along)
        place = np.floor(rows[:, 1:3] / self._edge).astype(np.int64)
        order = np.lexsort(place.T)
        changes = np.flatnonzero((np.diff(place[order], axis=0) != 0).any(axis=1)) + 1
        try:
            for some in np.split(order, changes):
                block = tuple(place[some[0]].tolist())
                self.blocks.add(block)
                with self._file(block).open('ab') as stream:
                    stream.write(rows[some].tobytes())
        except OSError as error:
            raise UnwritableFile(
                f'cannot write the map to {self._folder}: {error.strerror or error}'
            ) from error

    def parts(self, gap):
        """Yield each `Part` of the map.

        gap: along the way, from which on a scan is of another pass than that before it [m].
        """
        along = np.array(self._along)
        for block in sorted(self.blocks):
            for low, high in self._boxes(block):
                rows = self._within(low, high, margin=BALL * self._voxel_size)
                yield self._part(rows, (low, high), along, gap)

    def _part(self, rows, box, along, gap):
        size = self._voxel_size
        points, weights = merged(rows, size)
        inside = _inside(points, *box)
        # what lies in the margin is of other parts: it is a member of balls alone
        own = MapRows(*(each[_inside(rows.mean, *box)] for each in rows))
        found = consistency_of(own, along, CELL * size, gap)
        return Part(points[inside], found.plus(entropy_of(points, weights, inside, BALL * size)))

    def _boxes(self, block):
        """Return the corners, low and high, of the parts that a block is read in."""
        count = self._file(block).stat().st_size // (8 * COLUMNS)
        cuts = 1
        while count > cuts * cuts * MOST_ROWS and cuts < CELLS:
            cuts *= 2  # cells are not cut
        corners = np.arange(cuts) * (self._edge / cuts)
        low = np.array(block) * self._edge
        return [(low + (x, y), low + (x, y) + self._edge / cuts) for x in corners for y in corners]

    def _within(self, low, high, margin):
        """Return the `MapRows` of a box and a margin around it."""
        first, last = (
            np.floor((corner + side * margin) / self._edge).astype(int)
            for corner, side in ((low, -1), (high, 1))
        )
        places = [
            (x, y)
            for x in range(first[0], last[0] + 1)
            for y in range(first[1], last[1] + 1)
            if (x, y) in self.blocks
        ]
        found = [np.empty((0, COLUMNS))]
        for place in places:
            with self._file(place).open('rb') as stream:
                while len(rows := np.fromfile(stream, '<f8', COLUMNS * MOST_ROWS)):
                    rows = rows.reshape(-1, COLUMNS)
                    found.append(rows[_inside(rows[:, 1:4], low - margin, high + margin)])
        rows = np.concatenate(found)
        return MapRows(rows[:, 1:4], rows[:, 4:], rows[:, 0].astype(np.int64))

    def _file(self, block):
        return self._folder / f'{block[0]}_{block[1]}.rows'


def _inside(points, low, high):
    xy = points[:, :2]
    return ((xy >= low) & (xy < high)).all(axis=1)


def _rows(points, pose, voxel_size, number):
    """Return the voxels of a scan where a pose puts it, as rows on disk."""
    mean, weights = reduce_to_voxels(points, AS_MEASURED, voxel_size)
    scatter = weights[:, [1, 2, 3, 2, 4, 5, 3, 5, 6]].reshape(-1, 3, 3)
    turned = pose[:3, :3] @ scatter @ pose[:3, :3].T
    rows = np.empty((len(mean), COLUMNS), '<f8')
    rows[:, 0], rows[:, 1:4], rows[:, 4] = number, transform_points(pose, mean), weights[:, 0]
    rows[:, 5:] = turned[:, UPPER[0], UPPER[1]]
    return rows
