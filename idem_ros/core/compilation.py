"""Compile every kernel, or load it from numba's cache, before the first cloud arrives."""

from dataclasses import replace

import numpy as np

from idem_ros.core.arrays import Points, Triple
from idem_ros.core.config import AUTO, RegistrationConfig
from idem_ros.core.geometry.undistortion import moved_in_time
from idem_ros.core.maps.map_cloud import MapCloud
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.registration import register

CORRIDOR, HALL = (np.inf, 3.0, 2.0), (12.0, 8.0, 2.0)  # [m] half of their sides
REACH, NOISE = 30.0, 0.02  # [m]
FEW, MANY = (16, 200), (64, 1000)  # rings, columns; the first scans find the memory of many


def warm_up(motion: str = 'none') -> None:
    """Run every kernel once on scans of a corridor and of a hall: a blink where they are compiled.

    Args:
        motion: of the `RegistrationConfig` to come; what undoes a motion is left out with none.
    """
    few, many = _scan(CORRIDOR, *FEW), _scan(HALL, *MANY)
    for size in (None, 0.5, AUTO):
        register(few, few, config=RegistrationConfig(voxel_size=size, max_iterations=1))
    once = RegistrationConfig(voxel_size=0.5, max_iterations=1)
    register(MapCloud(few), few, config=once)
    register(many, many[::-1], config=once)
    if motion == 'none':
        return
    times = np.linspace(0.0, 0.1, len(few))
    source = Cloud(few, times)
    register(few, source, config=replace(once, motion=motion), twist=np.zeros(6))
    times.flags.writeable = False  # as those of a cloud are
    moved_in_time(source.points, times, np.tile(np.eye(4), (2, 1, 1)), 0.0, 0.1)


def _scan(half_sides: Triple, rings: int, columns: int) -> Points:
    """Return what a spinning LiDAR sees from the middle of a box, (N, 3)."""
    up, around = np.meshgrid(
        np.linspace(-0.4, 0.4, rings), np.linspace(0.0, 2 * np.pi, columns, endpoint=False)
    )
    level = np.cos(up)
    ray = np.stack([level * np.cos(around), level * np.sin(around), np.sin(up)], axis=-1)
    points: Points = ray / (np.abs(ray) / half_sides).max(axis=-1, keepdims=True)
    seen: Points = points[np.abs(points).max(axis=-1) < REACH]
    return seen + np.random.default_rng(0).normal(0.0, NOISE, seen.shape)
