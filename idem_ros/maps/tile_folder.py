"""A map in tiles, of which only those near the scan are in memory."""

import logging
import threading

import numpy as np

from idem_ros.core.exceptions import IdemError
from idem_ros.core.maps.point_blocks import PointBlocks
from idem_ros.files.cloud_file import read_cloud
from idem_ros.maps.plausible import require_metres
from idem_ros.maps.source import UnusableMap
from idem_ros.maps.tile_index import clouds_of

MOST_BYTES = 2**29  # of points in memory, unless one tile is more
SORTED = 32.0  # [m]: edge of the cubes that a tile's points are sorted into
A_POINT = 28  # bytes in memory, with its place in an order
HEIGHTS = -12_000.0, 12_000.0  # [m] that a map may have; its metadata say nothing of z
EDGE = 0.05  # [m] by which points lie outside of their tile where float32 rounded them

logger = logging.getLogger(__name__)


class TileFolder:
    """The tiles of a `TileIndex`; each is read when a place in it is asked for.

    A tile that cannot be read is named once, and is empty from then on.

    Args:
        index: `TileIndex`.
        most_bytes: of points in memory; those asked for longest ago make room.

    Attributes:
        name, bounds: see `MapSource`.
        unreadable: {path: why} of tiles.
    """

    def __init__(self, index, most_bytes=MOST_BYTES):
        self.name = str(index.paths[0].parent)
        self.bounds = np.empty((2, 3))
        self.bounds[:, :2] = index.low.min(axis=0), index.high.max(axis=0)
        self.bounds[:, 2] = HEIGHTS
        self.unreadable = {}
        self._index, self._most_bytes = index, most_bytes
        self._tiles = {}  # by number, the one asked for last at the end; None: empty
        self._lock = threading.Lock()  # around `_tiles`
        self._reading = threading.Lock()  # a tile is read once, and one at a time

    def __len__(self):
        return len(self._index.paths)

    @property
    def nbytes(self):
        """What is in memory [bytes]."""
        with self._lock:
            return sum(map(_bytes_of, self._tiles.values()))

    def points_within(self, low, high):
        """Return the (N, 3) points with low <= p < high."""
        low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
        # a point that was rounded lies in the box of the tile beside its own
        tiles = map(self._tile, self._index.touched(low - EDGE, high + EDGE).tolist())
        found = [tile.points_within(low, high) for tile in tiles if tile is not None]
        return np.concatenate(found) if found else np.empty((0, 3))

    def keep_near(self, center, reach):
        """Forget the tiles that are twice as far from a place as scans near it reach."""
        center = np.asarray(center, dtype=np.float64)
        near = set(self._index.touched(center - 2 * reach, center + 2 * reach).tolist())
        with self._lock:
            for i in self._tiles.keys() - near:
                del self._tiles[i]

    def _tile(self, i):
        found, is_there = self._kept(i)
        if is_there:
            return found
        with self._reading:
            found, is_there = self._kept(i)
            if not is_there:
                points = self.read(self._index.paths[i])
                found = None if points is None else _sorted(points)
                self._keep(i, found)
        return found

    def _kept(self, i):
        with self._lock:
            if i not in self._tiles:
                return None, False
            self._tiles[i] = self._tiles.pop(i)
            return self._tiles[i], True

    def _keep(self, i, tile):
        with self._lock:
            self._tiles[i] = tile
            sizes = {k: _bytes_of(each) for k, each in self._tiles.items()}
            total = sum(sizes.values())
            for oldest, size in sizes.items():
                if total <= self._most_bytes or oldest == i:
                    break
                del self._tiles[oldest]
                total -= size

    def read(self, path):
        """Return the (N, 3) points of a tile; None where it cannot be read, which is said once."""
        if path in self.unreadable:
            return None
        try:
            return self._within_box(self._index.paths.index(path), read_cloud(path))
        except IdemError as error:
            self.unreadable[path] = str(error)
            logger.warning('tile left out of the map: %s', error)
            return None

    def _within_box(self, i, points):
        low, high = self._index.low[i], self._index.high[i]
        xy = points[:, :2]
        inside = ((xy >= low - EDGE) & (xy <= high + EDGE)).all(axis=1)
        if inside.all():
            return points
        path, outside = self._index.paths[i], len(points) - int(inside.sum())
        if 2 * outside > len(points):
            raise UnusableMap(
                f'{path}: {outside} of its {len(points)} points lie outside of its box '
                f'{low.tolist()} to {high.tolist()}; it or the metadata are of another map'
            )
        logger.warning(
            '%s: %d of its %d points lie outside of its box and are left out',
            *(path, outside, len(points)),
        )
        return points[inside]


def _sorted(points):
    """Return `PointBlocks`, sorted for boxes of a few dozen metres whatever comes first."""
    tile = PointBlocks(points)
    tile.points_within(tile.bounds[0], tile.bounds[0] + SORTED)
    return tile


def _bytes_of(tile):
    return 0 if tile is None else A_POINT * len(tile)


def open_tiles(index):
    """Return the `TileFolder` of a `TileIndex`, with what is missing named.

    Raises:
        UnusableMap: none of its tiles is there, or the first that holds points is in no metres.
    """
    present = [path for path in index.paths if path.is_file()]
    folder = index.paths[0].parent
    if not present:
        raise UnusableMap(f'{folder} holds none of the {len(index.paths)} tiles of its metadata')
    _name('its metadata name, but it lacks', folder, set(index.paths) - set(present))
    _name('its metadata do not name', folder, set(clouds_of(folder)) - set(index.paths))
    tiles = TileFolder(index)
    tiles.unreadable = {path: 'it is not there' for path in set(index.paths) - set(present)}
    for path in present:
        if (points := tiles.read(path)) is not None:
            require_metres(points, tiles.points_within, tiles.name)
            return tiles
    raise UnusableMap(
        f'{tiles.name}: none of its tiles can be read; the first: {tiles.unreadable[present[0]]}'
    )


def _name(what, folder, paths):
    if paths:
        names = ', '.join(sorted(path.name for path in paths)[:5])
        more = f' and {len(paths) - 5} more' if len(paths) > 5 else ''
        logger.warning('%s: %s %s%s', folder, what, names, more)
