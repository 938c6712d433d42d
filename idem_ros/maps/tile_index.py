"""Which tile of a map covers which box: the metadata that Autoware's loader reads."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from idem_ros.files.cloud_file import READERS
from idem_ros.files.structured_text import UnreadableText, read_yaml
from idem_ros.maps.source import UnusableMap

METADATA = 'pointcloud_map_metadata.yaml'
FOLDERS = ('pointcloud_map.pcd', 'pointcloud_map')  # of tiles, within that of a whole map
RESOLUTIONS = ('x_resolution', 'y_resolution')
MOST_BYTES, MOST_VALUES = 2**24, 2**20  # a hundred thousand tiles
EXPECTED = 'x_resolution: 20.0, y_resolution: 20.0 and a line A.pcd: [1200, 2500] for each tile'


@dataclass(frozen=True)
class TileIndex:
    """The tiles of a map, in the order of their names."""

    paths: tuple[Path, ...]
    low: NDArray
    """(T, 2) least x and y of each."""
    size: NDArray
    """(2,) of a tile along x and y; also of one that lies at the edge of the map."""
    metadata: Path
    """The file that says so."""

    @property
    def high(self):
        """(T, 2): the corners opposite of `low`."""
        return self.low + self.size

    def touched(self, low, high):
        """Return the indices of the tiles that share a place with the box low <= xy < high."""
        return np.flatnonzero(
            (self.low < high[:2]).all(axis=1) & (self.high > low[:2]).all(axis=1)
        )


def find_map(path):
    """Return the `TileIndex` of a folder of tiles, or the `Path` of the one file that a map is.

    A folder is one of tiles with their metadata in it or beside it, or one of a whole map that
    holds such a folder or one cloud.

    Raises:
        UnusableMap: nothing is there, or it does not say where its tiles lie.
    """
    path = Path(path)
    if not path.is_dir():
        if not path.exists():
            raise UnusableMap(
                f'{path} is not there; it must be a map: a cloud or a folder of tiles'
            )
        return path
    indices = [*_indices_of(path)]
    for index in indices:
        if any(tile.is_file() for tile in index.paths):
            return index
    if indices:
        return indices[0]
    clouds = clouds_of(path)
    if len(clouds) == 1:
        return clouds[0]
    raise UnusableMap(
        f'{path} holds {len(clouds)} clouds and no {METADATA}; '
        f'`idem map tile {path} --out FOLDER` makes tiles of them'
    )


def _indices_of(path):
    """Yield what metadata say of a folder, or of one within it that may hold its tiles."""
    for folder in (path, *(path / name for name in FOLDERS)):
        for metadata in (folder / METADATA, folder.parent / METADATA):
            if folder.is_dir() and metadata.is_file():
                yield read_tile_index(metadata, folder)


def map_files(path):
    """Return the files that a map is read from: one, or metadata and the tiles that are there.

    Raises:
        UnusableMap: see `find_map`.
    """
    found = find_map(path)
    if not isinstance(found, TileIndex):
        return [found]
    return [found.metadata, *(each for each in found.paths if each.is_file())]


def clouds_of(folder):
    """Return the cloud files of a folder by their names."""
    return sorted(
        each
        for each in folder.iterdir()
        if each.suffix.lower() in READERS and each.is_file() and not each.name.startswith('.')
    )


def read_tile_index(metadata, folder):
    """Return the `TileIndex` of a file of metadata and the folder of its tiles.

    Raises:
        UnusableMap: it is no such file, or says what no tile is.
    """
    try:
        content = read_yaml(metadata, MOST_BYTES, MOST_VALUES)
    except UnreadableText as error:
        raise UnusableMap(str(error)) from error
    if not isinstance(content, dict):
        raise UnusableMap(f'{metadata} holds no tiles; it must say {EXPECTED}')
    size = [_size(metadata, content, name) for name in RESOLUTIONS]
    corners = {name: at for name, at in content.items() if name not in RESOLUTIONS}
    if not corners:
        raise UnusableMap(f'{metadata} names no tile; it must say {EXPECTED}')
    for name, at in corners.items():
        if Path(name).name != name:
            raise UnusableMap(f'{metadata} names {name[:60]!r}; it must be a file of {folder}')
        if not (isinstance(at, list) and len(at) == 2 and all(map(_is_number, at))):
            raise UnusableMap(f'{metadata}: {name} is at {at!r:.60}; it must be its least [x, y]')
    names = sorted(corners)
    low = np.array([corners[name] for name in names], dtype=np.float64)
    return TileIndex(tuple(folder / name for name in names), low, np.array(size), metadata)


def _size(metadata, content, name):
    size = content.get(name)
    if not (_is_number(size) and size > 0):
        raise UnusableMap(f'{metadata}: {name} is {size!r:.60}; it must be a number of metres')
    return float(size)


def _is_number(value):
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and math.isfinite(value) and abs(value) < 1e12
