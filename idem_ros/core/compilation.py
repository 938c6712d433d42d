"""Compile every kernel, or load it from numba's cache, before the first cloud arrives."""

import numpy as np

from idem_ros.core.config import RegistrationConfig
from idem_ros.core.registration import register


def warm_up() -> None:
    """Run every kernel once on a small cloud: seconds with a cold cache, a blink with a warm."""
    points = np.random.default_rng(0).random((64, 3))
    register(points, points, config=RegistrationConfig(voxel_size=0.1, max_iterations=1))
    register(points, points, config=RegistrationConfig(radius_schedule=(1.0,), max_iterations=1))
