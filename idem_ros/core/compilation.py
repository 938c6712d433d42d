"""Compile every kernel, or load it from numba's cache, before the first cloud arrives."""

import numpy as np

from idem_ros.core.config import RegistrationConfig
from idem_ros.core.geometry.moves import moved_in_time
from idem_ros.core.maps.map_cloud import MapCloud
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.registration import register


def warm_up(motion: str = 'none') -> None:
    """Run every kernel once on a small cloud: seconds with a cold cache, a blink with a warm.

    Args:
        motion: of the `RegistrationConfig` to come; what undoes a motion is left out with none.
    """
    points = np.random.default_rng(0).random((64, 3))
    for target in (points, MapCloud(points)):
        register(target, points, config=RegistrationConfig(voxel_size=0.1, max_iterations=1))
    register(points, points, config=RegistrationConfig(radius_schedule=(1.0,), max_iterations=1))
    if motion == 'none':
        return
    times = np.linspace(0.0, 0.1, len(points))
    source = Cloud(points, times)
    config = RegistrationConfig(voxel_size=0.1, max_iterations=1, motion=motion)
    register(points, source, config=config, twist=np.zeros(6))
    times.flags.writeable = False  # as those of a cloud are
    moved_in_time(source.points, times, np.tile(np.eye(4), (2, 1, 1)), 0.0, 0.1)
