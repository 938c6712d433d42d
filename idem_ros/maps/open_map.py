"""Open a map, whatever it is: a cloud of any format, or a folder of tiles."""

import logging
from pathlib import Path

from idem_ros.maps.map_file import read_map_file
from idem_ros.maps.tile_folder import open_tiles
from idem_ros.maps.tile_index import find_map

WORTH_SAYING = 10_000_000  # bytes that take a moment to read

logger = logging.getLogger(__name__)


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
