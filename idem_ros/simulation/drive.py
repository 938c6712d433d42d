"""Where the sensor goes: exact poses along a scene's route, and guesses off by an exact amount."""

import itertools
import math

import numpy as np
from scipy.spatial.transform import Rotation

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.geometry.se3 import ROS_ORDER, inverse, log, rotate

HEIGHT_M = 1.8  # of the sensor above the route
SWAY_DEG, BOUNCE_M = 0.7, 0.02
SWAYS = np.array([0.5, 0.7, 0.9])  # [Hz] of rolling, pitching and bouncing, in motion
WEAVE_S = 4.0  # from one look to the left to the next


def drive(scene, scans, rng, height_m=HEIGHT_M, lateral_m=0.0):
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
    position, yaw, climb = _along(path, length, stops)
    roll, pitch = np.radians(rng.normal(0.0, SWAY_DEG, (2, scans)))
    position[:, 2] += rng.normal(0.0, BOUNCE_M, scans)
    return _poses(position, np.column_stack([yaw, pitch - climb, roll]))


def moving_drive(scene, scans, rng, speed, turn_rate=0.0, sweep_s=0.1):
    """Return where a sensor is that is carried along a scene's route without a halt.

    From the begin of one sweep to the begin of the next it moves by one twist: its pose at the
    time t of the k-th is poses[k] exp(t twists[k]), exactly. It rolls, pitches and bounces gently,
    and looks to the left and to the right of the way, with up to `turn_rate`.

    Args:
        scene: Scene with a route.
        scans: how many sweeps, from the start of the route.
        rng: np.random.Generator.
        speed: along the route [m/s].
        turn_rate: the fastest that it turns about its own z axis [rad/s], beside the route's own.
        sweep_s: what a sweep takes [s].

    Returns:
        (scans + 1, 4, 4) T_world_sensor at the begin of each sweep, and at the end of the last;
        (scans, 6) twists x y z [m/s] rx ry rz [rad/s] in the sensor's own axes.

    Raises:
        InvalidConfig: no sweep, a scene without a route, or one too short.
    """
    if scans < 1 or len(scene.route) < 2:
        raise InvalidConfig(f'{scans} sweeps on a route of {len(scene.route)} points')
    path = _path_of_sensor(scene.route, rng, HEIGHT_M, 0.0)
    length = _arc_length(path)
    times = sweep_s * np.arange(scans + 1)
    if speed * times[-1] > length[-1]:
        raise InvalidConfig(
            f'{scans} sweeps of {sweep_s:g} s at {speed:g} m/s take {speed * times[-1]:.0f} m; '
            f'the route is {length[-1]:.0f} m long'
        )
    position, yaw, climb = _along(path, length, speed * times)
    phase = rng.uniform(0.0, 2 * np.pi, 4)
    sway = np.sin(2 * np.pi * np.outer(SWAYS, times) + phase[:3, None])
    roll, pitch = np.radians(SWAY_DEG) * sway[:2]
    position[:, 2] += BOUNCE_M * sway[2]
    way = 2 * np.pi * times / WEAVE_S + phase[3]
    yaw = yaw + turn_rate * WEAVE_S / (2 * np.pi) * np.sin(way)
    poses = _poses(position, np.column_stack([yaw, pitch - climb, roll]))
    steps = [log(inverse(T) @ after) for T, after in itertools.pairwise(poses)]
    return poses, np.array(steps)[:, ROS_ORDER] / sweep_s


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


def _along(path, length, stops):
    """Return position (N, 3), heading and climb [rad] at distances along a path."""
    slope = np.gradient(path, axis=0)
    position = np.column_stack([np.interp(stops, length, path[:, k]) for k in range(3)])
    ahead = np.column_stack([np.interp(stops, length, slope[:, k]) for k in range(3)])
    yaw = np.arctan2(ahead[:, 1], ahead[:, 0])
    return position, yaw, np.arctan2(ahead[:, 2], np.hypot(ahead[:, 0], ahead[:, 1]))


def _poses(position, angles):
    """Return (N, 4, 4) of positions (N, 3) and yaw, pitch, roll (N, 3) [rad]."""
    poses = np.tile(np.eye(4), (len(position), 1, 1))
    poses[:, :3, :3] = Rotation.from_euler('ZYX', angles).as_matrix()
    poses[:, :3, 3] = position
    return poses


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
