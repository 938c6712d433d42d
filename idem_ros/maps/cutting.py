"""Cut maps into tiles, in the layout that Autoware's loader reads."""

from pathlib import Path

from idem_ros.files.atomic_folder import filling
from idem_ros.files.cloud_file import cloud_parts
from idem_ros.maps.tile_index import clouds_of, find_map
from idem_ros.maps.tile_writer import TileWriter


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
