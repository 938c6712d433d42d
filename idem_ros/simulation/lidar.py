"""A spinning LiDAR: rings of rays, range noise, drop-outs, and one scan of a scene."""

import math
from dataclasses import dataclass

import numpy as np

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.geometry.se3 import ROS_ORDER, checked_transform, exp, rotate
from idem_ros.simulation.raycast import cast


@dataclass(frozen=True)
class Lidar:
    """A sensor with x forward, y left, z up; the defaults are those of a 32-ring car LiDAR.

    Attributes:
        rings: number of elevations, evenly spaced from `lowest_deg` to `highest_deg`.
        lowest_deg: elevation of the lowest ring [deg].
        highest_deg: elevation of the highest ring [deg].
        azimuth_steps: rays of a ring in one turn.
        range_noise_m: standard deviation of a range [m].
        dropout: share of the returns that are lost, 0 to 1.
        min_range_m: surfaces nearer than this give no return [m].
        max_range_m: surfaces farther than this give no return [m].
    """

    rings: int = 32
    lowest_deg: float = -25.0
    highest_deg: float = 15.0
    azimuth_steps: int = 720
    range_noise_m: float = 0.015
    dropout: float = 0.07
    min_range_m: float = 1.0
    max_range_m: float = 50.0

    def __post_init__(self):
        requirements = {
            'rings and azimuth_steps must be from 1': min(self.rings, self.azimuth_steps) >= 1,
            'elevations must rise, within -90 to 90 deg': (
                -90 <= self.lowest_deg <= self.highest_deg <= 90
            ),
            'range_noise_m must be finite and from 0': 0 <= self.range_noise_m < math.inf,
            'dropout must be from 0 to 1': 0 <= self.dropout <= 1,
            'ranges must satisfy 0 <= min < max': 0 <= self.min_range_m < self.max_range_m,
        }
        for requirement, met in requirements.items():
            if not met:
                raise InvalidConfig(f'{self}: {requirement}')


def scan(scene, T_world_sensor, lidar, rng):
    """Return the points of one turn, seen from one pose: there is no motion distortion.

    Args:
        scene: Scene in the world frame.
        T_world_sensor: (4, 4) exact pose of the sensor.
        lidar: Lidar.
        rng: np.random.Generator; the same state gives the same points.

    Returns:
        (N, 3) points in the sensor frame [m], ring by ring from below, each ring in azimuth.

    Raises:
        InvalidTransform: `T_world_sensor` is not a rigid transform.
    """
    pose = checked_transform(T_world_sensor, 'T_world_sensor')
    directions = ray_directions(lidar, first_turn=rng.random())
    ranges = cast(scene, pose[:3, 3], rotate(pose[:3, :3], directions), lidar.max_range_m)
    points, _ = _returns(directions, ranges, lidar, rng)
    return points


def moving_scan(scene, T_world_sensor, twist, sweep_s, lidar, rng):
    """Return the points of one turn of a sensor that moves meanwhile, and their times.

    At the time t its pose is T_world_sensor exp(t twist), exactly; all rings of an azimuth are
    measured at once.

    Args:
        scene: Scene in the world frame.
        T_world_sensor: (4, 4) pose at the begin of the sweep.
        twist: (6,) x y z [m/s] rx ry rz [rad/s] of the sensor, in its own axes.
        sweep_s: what the turn takes [s].
        lidar: Lidar.
        rng: np.random.Generator; the same state gives the same points.

    Returns:
        (N, 3) points, each in the sensor frame at its own time [m], in the order of `scan`; and
        (N,) times from the begin of the sweep [s].

    Raises:
        InvalidTransform: `T_world_sensor` is not a rigid transform.
    """
    pose = checked_transform(T_world_sensor, 'T_world_sensor')
    directions = ray_directions(lidar, first_turn=rng.random())
    steps = lidar.azimuth_steps
    times = sweep_s * np.arange(steps) / steps
    rays, origins = np.empty_like(directions), np.empty_like(directions)
    for k, time in enumerate(times):
        there = pose @ exp(time * np.asarray(twist, np.float64)[ROS_ORDER])
        rays[k::steps] = rotate(there[:3, :3], directions[k::steps])
        origins[k::steps] = there[:3, 3]
    ranges = cast(scene, origins, rays, lidar.max_range_m)
    points, kept = _returns(directions, ranges, lidar, rng)
    return points, np.tile(times, lidar.rings)[kept]


def _returns(directions, ranges, lidar, rng):
    """Return the points of rays that return, in the sensor's frame, and which rays they are."""
    # Drawn for every ray, hit or not: a change of the scene leaves the other rays' noise alone.
    noise = rng.normal(0.0, lidar.range_noise_m, len(directions))
    kept = rng.random(len(directions)) >= lidar.dropout
    kept &= np.isfinite(ranges) & (ranges >= lidar.min_range_m)
    return directions[kept] * (ranges + noise)[kept, None], kept


def ray_directions(lidar, first_turn=0.0):
    """Return the (rings * azimuth_steps, 3) unit directions, the first `first_turn` steps on."""
    elevation = np.radians(np.linspace(lidar.lowest_deg, lidar.highest_deg, lidar.rings))
    turn = 2 * np.pi * (np.arange(lidar.azimuth_steps) + first_turn) / lidar.azimuth_steps
    elevation, azimuth = (grid.ravel() for grid in np.meshgrid(elevation, turn, indexing='ij'))
    flat = np.cos(elevation)
    return np.column_stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)])
