"""A simulated LiDAR scan of a building's outer masonry staircase."""

import numpy as np

from idem_ros.core.geometry.se3 import transform_points
from idem_ros.simulation.lidar import Lidar, scan
from idem_ros.simulation.scene import Scene, box

STEPS, RISE, TREAD, WIDE = 12, 0.17, 0.32, 3.0  # of one flight [m]
LANDING = 2.0
STATIONS = ((-6.0, -4.5), (2.0, -7.0), (9.0, -5.5), (-2.0, -9.0))  # of the scanner [m]
HEIGHT = 1.6
SCANNER = Lidar(
    rings=160, lowest_deg=-50.0, highest_deg=40.0, azimuth_steps=600, range_noise_m=0.006
)
REACH = (14.0, 10.0)  # kept to either side of the middle in x and y [m]


def stairs_scan(rng, count, moved=0.0):
    """Return (count, 3) points of a terrestrial scan from four stations, registered [m].

    The frame's z is up; the stairs climb along x in front of a wall. The stations are moved by
    a length along x and y [m]: another scan of the same stairs, by other rays.
    """
    scene = stairs()
    stations = np.add(STATIONS, moved)
    points = np.concatenate([_from_station(scene, x, y, rng) for x, y in stations])
    points = points[(np.abs(points[:, :2]) <= REACH).all(axis=1)]
    return points[np.sort(rng.choice(len(points), count, replace=False))]


def stairs():
    """Return the `Scene`: two flights and a landing, parapet, wall with openings, ground."""
    half = WIDE / 2
    rows = [box((-14.0, -11.0, -0.3), (14.0, half, 0.0)), *_wall(half)]
    x, z = -5.0, 0.0
    for flight in range(2):
        for _ in range(STEPS):
            z += RISE
            rows.append(box((x, -half, 0.0), (x + TREAD, half, z)))
            x += TREAD
        length = LANDING if flight == 0 else 2 * LANDING
        rows.append(box((x, -half, 0.0), (x + length, half, z)))
        rows.append(box((x, -half - 0.2, 0.0), (x + length, -half, z + 0.9)))  # parapet
        x += length
    posts = [(-5.2, -half - 0.1, 0.0, 1.1, 0.12), (x, -half - 0.1, 0.0, z + 1.1, 0.12)]
    posts += [(-9.0, -2.5, 0.0, 3.8, 0.08), (11.5, -3.0, 0.0, 3.8, 0.08)]
    crowns = [(-9.0, -2.5, 4.1, 0.35), (11.5, -3.0, 4.1, 0.35), (-8.0, 0.0, 0.5, 0.7)]
    return Scene(boxes=rows, cylinders=posts, spheres=crowns)


def _wall(y):
    """A facade behind the stairs, with pilasters and the frames of its openings."""
    rows = [box((-14.0, y, 0.0), (14.0, y + 0.4, 8.0))]
    for x in (-12.5, -8.5, -3.5, 1.5, 7.0, 12.0):
        rows.append(box((x - 0.25, y - 0.15, 0.0), (x + 0.25, y, 8.0)))
    for x in (-10.5, -6.0, -1.0, 4.5, 9.5):
        rows.append(box((x - 0.7, y - 0.1, 5.0), (x + 0.7, y, 5.15)))
        rows.append(box((x - 0.7, y - 0.1, 6.8), (x + 0.7, y, 6.95)))
    return rows


def _from_station(scene, x, y, rng):
    T_world_sensor = np.eye(4)
    T_world_sensor[:3, 3] = x, y, HEIGHT
    return transform_points(T_world_sensor, scan(scene, T_world_sensor, SCANNER, rng))
