"""Where the sensor goes: exact poses along a scene's route, and guesses off by an exact amount."""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.geometry.se3 import rotate


def drive(scene, scans, rng, height_m=1.8, lateral_m=0.0):
    """Return evenly spaced poses of a sensor that is carried along a scene's route.

    It wanders sideways by up to 0.3 m, follows the slope of the ground, and rolls and pitches by
    some 0.7 deg as a car does on its springs.

    Args:
        scene: Scene with a route.
        scans: how many poses, from the start of the route to its end.
        rng: np.random.Generator.
        height_m: the sensor's height above the route [m].
        lateral_m: how far to the left of the route it keeps on average [m].

    Returns:
        (scans, 4, 4) T_world_sensor.

    Raises:
        InvalidConfig: fewer than two poses, or a scene without a route.
    """
    if scans < 2 or len(scene.route) < 2:
        raise InvalidConfig(f'{scans} scans on a route of {len(scene.route)} points; both from 2')
    path = _path_of_sensor(scene.route, rng, height_m, lateral_m)
    length = _arc_length(path)
    stops = np.linspace(0.0, length[-1], scans)
    slope = np.gradient(path, axis=0)
    position = np.column_stack([np.interp(stops, length, path[:, k]) for k in range(3)])
    ahead = np.column_stack([np.interp(stops, length, slope[:, k]) for k in range(3)])
    yaw = np.arctan2(ahead[:, 1], ahead[:, 0])
    climb = np.arctan2(ahead[:, 2], np.hypot(ahead[:, 0], ahead[:, 1]))
    roll, pitch = np.radians(rng.normal(0.0, 0.7, (2, scans)))
    position[:, 2] += rng.normal(0.0, 0.02, scans)
    poses = np.tile(np.eye(4), (scans, 1, 1))
    angles = np.column_stack([yaw, pitch - climb, roll])
    poses[:, :3, :3] = Rotation.from_euler('ZYX', angles).as_matrix()
    poses[:, :3, 3] = position
    return poses


def perturbed(T, rotation_deg, translation_m, rng):
    """Return a pose that is off by exactly these amounts, about a random axis, in any direction.

    Args:
        T: (4, 4) T_target_source; it turns about the source's own origin.
        rotation_deg: angle between the two rotations [deg].
        translation_m: distance between the two translations [m].
        rng: np.random.Generator.
    """
    turn = Rotation.from_rotvec(np.radians(rotation_deg) * _direction(rng)).as_matrix()
    result = np.array(T, dtype=np.float64)
    result[:3, :3] = rotate(result[:3, :3], turn.T).T
    result[:3, 3] += translation_m * _direction(rng)
    return result


def _path_of_sensor(ground, rng, height_m, lateral_m):
    """Return the points (N, 3) above a route that the sensor passes, wandering sideways."""
    length = _arc_length(ground)
    left = np.gradient(ground[:, :2], axis=0)[:, ::-1] * (-1.0, 1.0)
    left /= np.linalg.norm(left, axis=1, keepdims=True)
    wander = 0.3 * np.sin(2 * np.pi * length / rng.uniform(25, 40) + rng.uniform(0, 2 * np.pi))
    path = ground.copy()
    path[:, :2] += left * (lateral_m + wander)[:, None]
    path[:, 2] += height_m
    return path


def _arc_length(path):
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _direction(rng):
    vector = rng.normal(size=3)
    return vector / math.hypot(*vector)
