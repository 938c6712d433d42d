"""Cut a map into tiles, part by part: no more of it is in memory than a part, or a tile."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from idem_ros.files.atomic_file import filling
from idem_ros.files.cloud_file import cloud_parts
from idem_ros.files.pcd_file import write_pcd
from idem_ros.maps.plausible import near_the_rest
from idem_ros.maps.source import UnusableMap
from idem_ros.maps.tile_index import METADATA, clouds_of, find_map

MOST_TILES = 100_000
FLOAT32_REACH = 8192.0  # [m]: farther from zero float32 rounds by more than half a millimetre
FARTHEST = 10**9  # tiles from zero: strays, which are left out in the end
PART = '.part'  # of a tile that still grows: (N, 3) float64, bare


class Cut(NamedTuple):
    """What became of a map that was cut into tiles."""

    tiles: int
    points: int
    left_out: int
    """Points far from all the rest."""
    is_float64: bool
    """Whether a tile is in float64, as float32 would lose more than half a millimetre."""


class TileWriter:
    """Collects points into the tiles of a folder.

    Args:
        folder: `Path`, empty.
        size: edge of a tile [m], a whole number, as Autoware reads its corners.

    Attributes:
        counts: {(x, y) of a tile's corner: its points}.
    """

    def __init__(self, folder, size):
        self._folder, self._size = folder, int(size)
        self.counts = {}

    def add(self, points):
        """Append (N, 3) points to their tiles.

        Raises:
            UnusableMap: they make more tiles than any map has.
        """
        corner = np.floor(points[:, :2] / self._size)
        corner = np.clip(corner, -FARTHEST, FARTHEST).astype(np.int64)
        key = corner[:, 0] * (2 * FARTHEST + 1) + corner[:, 1]
        order = np.argsort(key, kind='stable')
        begins = np.flatnonzero(np.diff(key[order], prepend=key[order[0]] - 1))
        for rows in np.split(order, begins[1:]):
            x, y = corner[rows[0]].tolist()
            self._append((x * self._size, y * self._size), points[rows])

    def finish(self):
        """Write each tile as a PCD, and the metadata; return the `Cut`.

        What is far from all the rest is left out.
        """
        corners = np.array(sorted(self.counts), dtype=np.int64).reshape(-1, 2)
        counts = np.array([self.counts[tuple(each)] for each in corners.tolist()])
        kept = near_the_rest(np.insert(corners.astype(np.float64), 2, 0.0, axis=1), counts)
        is_fine = False
        for corner in corners[~kept].tolist():
            self._part(corner).unlink()
        for corner in corners[kept].tolist():
            is_fine |= self._finish_tile(corner)
        self._write_metadata(corners[kept].tolist())
        points = int(counts[kept].sum())
        return Cut(int(kept.sum()), points, int(counts.sum()) - points, is_fine)

    def _append(self, corner, points):
        self.counts[corner] = self.counts.get(corner, 0) + len(points)
        if len(self.counts) > MOST_TILES:
            raise UnusableMap(
                f'the map makes more than {MOST_TILES} tiles of {self._size} m: it is in another '
                'unit, or full of strays; a larger --size makes fewer'
            )
        with self._part(corner).open('ab') as stream:
            stream.write(np.ascontiguousarray(points, dtype='<f8').tobytes())

    def _finish_tile(self, corner):
        """Write a tile; return whether it takes float64 to lose nothing."""
        part = self._part(corner)
        points = np.fromfile(part, '<f8').reshape(-1, 3)
        is_near = np.abs(points).max() < FLOAT32_REACH
        is_fine = not is_near and not (points.astype(np.float32) == points).all()
        write_pcd(part.with_suffix('.pcd'), points, np.float64 if is_fine else np.float32)
        part.unlink()
        return is_fine

    def _write_metadata(self, corners):
        lines = [f'{axis}_resolution: {self._size:.1f}\n' for axis in 'xy']
        lines += [f'{self._name(corner)}.pcd: [{corner[0]}, {corner[1]}]\n' for corner in corners]
        (self._folder / METADATA).write_text(''.join(lines), encoding='utf-8')

    def _part(self, corner):
        return self._folder / (self._name(corner) + PART)

    @staticmethod
    def _name(corner):
        return f'{corner[0]}_{corner[1]}'


def clouds_to_cut(path):
    """Return the cloud files that a map is made of: itself, its tiles, or all of its folder.

    Raises:
        UnusableMap: there are none.
    """
    path = Path(path)
    if path.is_dir() and (clouds := clouds_of(path)):
        return clouds
    found = find_map(path)
    return [found] if isinstance(found, Path) else [each for each in found.paths if each.is_file()]


def cut_map(path, out, size, columns=None, on_points=lambda count: None):
    """Write the points of a map into tiles of a new folder; it appears complete or not at all.

    Args:
        path: a cloud, a folder of clouds, or of tiles.
        out: the folder to make.
        size: edge of a tile [m], a whole number.
        columns: see `read_cloud`.
        on_points: called with the number of points of each part when it is done.

    Returns:
        `Cut`.

    Raises:
        UnusableMap, UnreadableCloud: it cannot be read, or makes too many tiles.
        UnwritableFile: the folder cannot be made.
    """
    clouds = clouds_to_cut(path)
    with filling(out) as folder:
        writer = TileWriter(folder, size)
        for cloud in clouds:
            for points in cloud_parts(cloud, columns):
                writer.add(points)
                on_points(len(points))
        return writer.finish()
