"""Three kinds of sensors in the scenes that each is carried through, with exact truth."""

import numpy as np

from idem_ros.core.geometry.se3 import inverse
from idem_ros.simulation.drive import drive, perturbed
from idem_ros.simulation.lidar import Lidar, scan
from idem_ros.simulation.raycast import cast
from idem_ros.simulation.room import room
from idem_ros.simulation.street import street

LIDAR_16 = Lidar(16, -15.0, 15.0, 1800, range_noise_m=0.02, max_range_m=100.0)
LIDAR_64 = Lidar(64, -24.8, 2.0, 1900, range_noise_m=0.02, max_range_m=120.0)
STEPS = {'depth_camera': 0.1, 'lidar_16': 1.0, 'lidar_64': 1.0}  # [m] between two scans
GUESS = {'depth_camera': (2.0, 0.05), 'lidar_16': (1.5, 0.3), 'lidar_64': (1.5, 0.3)}  # [deg], [m]


def depth_scan(scene, T_world_sensor, rng, width=320, height=240):
    """Return what a depth camera of 69 by 42 deg sees from 0.3 to 6 m, x forward; (N, 3) [m].

    Its noise grows with the square of the depth, as Nguyen et al. (3DIMPVT 2012) measured it.
    """
    y, z = np.meshgrid(
        np.linspace(0.69, -0.69, width), np.linspace(0.38, -0.38, height), indexing='xy'
    )
    rays = np.stack([np.ones(y.size), y.ravel(), z.ravel()], axis=1)
    lengths = np.linalg.norm(rays, axis=1)
    directions = rays / lengths[:, None]
    ranges = cast(scene, T_world_sensor[:3, 3], directions @ T_world_sensor[:3, :3].T, 8.0)
    depth = ranges / lengths
    seen = (depth > 0.3) & (depth < 6.0)
    depth = depth[seen] + rng.normal(size=seen.sum()) * (
        0.0012 + 0.0019 * (depth[seen] - 0.4) ** 2
    )
    return rays[seen] * depth[:, None]


def pairs(sensor, count, seed=0):
    """Yield (target, source, guess, truth) of scans one after the other; as `STEPS` says."""
    rng = np.random.default_rng(seed)
    indoors = sensor == 'depth_camera'
    scene = room(rng) if indoors else street(rng)
    length = np.linalg.norm(np.diff(scene.route, axis=0), axis=1).sum()
    poses = drive(scene, int(length / STEPS[sensor]), rng, height_m=1.2 if indoors else 1.8)
    for i in np.linspace(0, len(poses) - 2, count).astype(int):
        target, source = (_scan(sensor, scene, pose, rng) for pose in poses[i : i + 2])
        truth = inverse(poses[i]) @ poses[i + 1]
        yield target, source, perturbed(truth, *GUESS[sensor], rng), truth


def _scan(sensor, scene, pose, rng):
    if sensor == 'depth_camera':
        return depth_scan(scene, pose, rng)
    return scan(scene, pose, {'lidar_16': LIDAR_16, 'lidar_64': LIDAR_64}[sensor], rng)
