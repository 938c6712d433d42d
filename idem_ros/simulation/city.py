"""A town as files: its map in tiles, and a recorded drive through it with exact truth."""

import numpy as np

from idem_ros.core.geometry import se3
from idem_ros.maps.tile_writer import TileWriter
from idem_ros.recording.writer import write_mcap
from idem_ros.simulation.drive import drive
from idem_ros.simulation.lidar import Lidar, scan
from idem_ros.simulation.recording import MAPPER_OFFSET_M, SCANNER, rounded, scan_messages
from idem_ros.simulation.street import LANE
from idem_ros.simulation.surfaces import Scene
from idem_ros.simulation.town import BLOCK, Town

MAP, DRIVE = 'map', 'drive.mcap'
LEAST_BLOCKS = 3
TILE = 100  # [m]
EVERY = 15.0  # [m] between scans that the map is made of
APART = 0.25  # [m]: of the points of a street in a cube of this edge the first is kept
SPEED, RATE = 15.0, 10.0  # [m/s] and scans a second of the drive
MAPPER = Lidar(azimuth_steps=900, lowest_deg=-30.0, highest_deg=25.0, range_noise_m=0.01)


def blocks_of(extent):
    """Return how many blocks along each side make a town of some extent [m]."""
    return max(round(extent / BLOCK), LEAST_BLOCKS)


def write_city(folder, extent, scans, seed, progress=lambda streets: streets):
    """Write the map of a town into `folder`/map and a drive through it into `folder`/drive.mcap.

    Both come street by street: what is in memory does not grow with the town or the drive. The
    frame of the map has its origin at a corner of the town.

    Args:
        folder: `Path`, empty.
        extent: of the town along each side [m].
        scans: of the drive.
        seed: from 0; the same one gives the same files.
        progress: wraps the iteration over the streets of the map.

    Returns:
        The points of the map.
    """
    town = Town(seed, blocks_of(extent))
    tiles = folder / MAP
    tiles.mkdir()
    writer = TileWriter(tiles, TILE)
    for street in progress(_streets(town)):
        writer.add(_mapped(town, *street, np.random.default_rng([seed, *street])))
    points = writer.finish().points
    write_mcap(folder / DRIVE, _drive_messages(town, scans, np.random.default_rng([seed, 1])))
    return points


def _streets(town):
    """Return (i, j, whether along x) of each piece of street between two crossings."""
    edges = range(town.blocks + 1)
    return [
        (i, j, along_x)
        for i in edges
        for j in edges
        for along_x in (0, 1)
        if (i if along_x else j) < town.blocks
    ]


def _mapped(town, i, j, along_x, rng):
    """Return the points that a survey of a piece of street sees, in the town's frame."""
    route = Scene(route=town.street(i, j, along_x))
    poses = drive(route, round(BLOCK / EVERY), rng, lateral_m=MAPPER_OFFSET_M)
    seen = [se3.transform_points(pose, _scan(town, pose, MAPPER, rng)) for pose in poses]
    points = rounded(np.concatenate(seen))
    cubes = np.floor(points / APART).astype(np.int64)
    return points[np.sort(np.unique(cubes, axis=0, return_index=True)[1])]


def _drive_messages(town, scans, rng):
    route = town.route(scans * SPEED / RATE, rng)
    poses = drive(Scene(route=route), scans, rng, lateral_m=LANE)
    yield from scan_messages(poses, lambda pose: _scan(town, pose, SCANNER, rng), rng)


def _scan(town, pose, lidar, rng):
    return scan(town.near(pose[:3, 3], lidar.max_range_m), pose, lidar, rng)
