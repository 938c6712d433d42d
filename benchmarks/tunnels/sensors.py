"""Scan patterns: spinning LiDARs of 16 to 128 rings, a solid-state raster, rays at random."""

import numpy as np

from idem_ros.core.geometry import se3
from idem_ros.simulation.lidar import Lidar, ray_directions
from idem_ros.simulation.raycast import cast

NOISE, DROPOUT, NEAREST, FARTHEST = 0.015, 0.05, 1.0, 60.0
RAYS = 40_000  # of a scan at random
RASTER, FIELD = (320, 100), (120.0, 30.0)  # columns and rows, [deg]
RINGS = {
    '16 rings': (16, -15.0, 15.0, 900),
    '32 rings': (32, -25.0, 15.0, 900),
    '64 rings': (64, -24.8, 2.0, 900),
    '128 rings': (128, -22.5, 22.5, 600),
}
PATTERNS = (*RINGS, 'solid state', 'random')


def directions(pattern, rng):
    """Return (n, 3) unit rays of one scan."""
    if pattern in RINGS:
        rings, low, high, steps = RINGS[pattern]
        return ray_directions(Lidar(rings, low, high, steps), rng.random())
    if pattern == 'solid state':
        wide, high = (np.radians(f) / 2 for f in FIELD)
        azimuth, elevation = np.meshgrid(
            np.linspace(-wide, wide, RASTER[0]), np.linspace(-high, high, RASTER[1])
        )
        azimuth, elevation = azimuth.ravel(), elevation.ravel()
    else:
        azimuth = rng.uniform(-np.pi, np.pi, RAYS)
        elevation = np.arcsin(rng.uniform(np.sin(-0.45), np.sin(0.45), RAYS))
    flat = np.cos(elevation)
    return np.c_[flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)]


def scanned(scene, T_world_sensor, pattern, rng):
    """Return (n, 3) points of one scan in the sensor frame [m]."""
    rays = directions(pattern, rng)
    ranges = cast(scene, T_world_sensor[:3, 3], se3.rotate(T_world_sensor[:3, :3], rays), FARTHEST)
    seen = np.isfinite(ranges) & (ranges >= NEAREST) & (rng.random(len(rays)) >= DROPOUT)
    noise = rng.normal(0.0, NOISE, len(rays))
    return rays[seen] * (ranges + noise)[seen, None]
