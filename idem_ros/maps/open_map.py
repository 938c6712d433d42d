"""Open a map, whatever it is: a cloud of any format, or a folder of tiles."""

import logging
from pathlib import Path

import numpy as np

from idem_ros.core.maps.point_blocks import PointBlocks
from idem_ros.files.cloud_file import cloud_parts
from idem_ros.maps.plausible import near_the_rest, require_metres
from idem_ros.maps.tile_folder import open_tiles
from idem_ros.maps.tile_index import find_map

logger = logging.getLogger(__name__)

WORTH_SAYING = 10_000_000  # bytes that take a moment to read


class MapPoints(PointBlocks):
    """A map that is held in memory.

    Args:
        points: (N, 3) finite, N >= 1, in the map's frame [m].
        name: what messages call it.
    """

    def __init__(self, points, name):
        super().__init__(points)
        self.name = name

    def keep_near(self, center, reach):
        """Keep all of it: it is read once."""


def _without_strays(points, name):
    near = near_the_rest(points)
    if near.all():
        return points
    logger.warning('%s: %d points far from all the rest are left out', name, (~near).sum())
    return points[near]


def read_map_file(path, columns=None):
    """Read a map of one file, of any format that `read_cloud` takes.

    Raises:
        UnreadableCloud: it cannot be read.
        UnusableMap: its points stand too far apart to be in metres.
    """
    name = str(path)
    points = _without_strays(np.concatenate(list(cloud_parts(path, columns))), name)
    read = MapPoints(points, name)
    require_metres(points, read.points_within, name)
    return read


def open_map(path, say=logger.info):
    """Open a map; a file is read at once, tiles when they are needed.

    Args:
        path: a cloud file, as `read_cloud` takes it, or a folder of tiles in Autoware's layout.
        say: called with lines on how far it is.

    Returns:
        A `MapSource`.

    Raises:
        UnusableMap, UnreadableCloud: in one line, why it cannot be used.
    """
    found = find_map(path)
    if not isinstance(found, Path):
        tiles = open_tiles(found)
        x, y = found.size
        say(f'map {path}: {len(tiles)} tiles of {x:g} x {y:g} m, read as they are needed')
        return tiles
    if (size := found.stat().st_size) > WORTH_SAYING:
        say(f'map {found}: reading {size / 1e6:.3g} MB')
    points = read_map_file(found)
    extent = ' x '.join(f'{side:.4g}' for side in points.bounds[1] - points.bounds[0])
    say(f'map {found}: {len(points)} points, {extent} m')
    return points
