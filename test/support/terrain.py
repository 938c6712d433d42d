"""A map without end: hills and walls over the plane, sampled where one asks."""

import numpy as np

from idem_ros.core.geometry import se3
from idem_ros.simulation.drive import perturbed

WALLS = 24.0  # a wall stands along x or y in each square of this edge


def points_around(middle, reach, rng, density=2.0):
    """About (2 reach)^2 density points of the ground, and those of the walls, around a place."""
    low, high = np.array(middle[:2]) - reach, np.array(middle[:2]) + reach
    ground = rng.uniform(low, high, (int(density * np.prod(high - low)), 2))
    parts = [np.column_stack([ground, _height(*ground.T)])]
    for i in range(*_squares(low[0], high[0])):
        for j in range(*_squares(low[1], high[1])):
            parts.append(_wall(i, j, rng, density))
    points = np.concatenate(parts)
    return points[((points[:, :2] >= low) & (points[:, :2] < high)).all(axis=1)]


def scan_at(middle, reach, rng, yaw=0.3):
    """Points as a sensor there has them, and where it stands: T_map_scan."""
    truth = se3.translation((*middle[:2], _height(*middle[:2]) + 1.5))
    truth[:2, :2] = (np.cos(yaw), -np.sin(yaw)), (np.sin(yaw), np.cos(yaw))
    points = points_around(middle, reach, rng, density=1.5)
    points += rng.normal(0.0, 0.02, points.shape)
    return se3.transform_points(se3.inverse(truth), points), truth


def guess_near(truth, rng, degrees=1.5, distance=0.4):
    return perturbed(truth, degrees, distance, rng)


def _height(x, y):
    return 2.0 * np.sin(x / 17.0) + 1.5 * np.cos(y / 13.0 + 0.02 * x)


def _squares(low, high):
    return int(np.floor(low / WALLS)), int(np.floor(high / WALLS)) + 1


def _wall(i, j, rng, density):
    """Points of the wall of a square: its place is the square's own, the points are at random."""
    own = np.random.default_rng([i + 1000, j + 1000])
    x, y = (i + own.uniform(0.2, 0.8)) * WALLS, (j + own.uniform(0.2, 0.8)) * WALLS
    along, length, height = own.integers(2), own.uniform(6.0, 14.0), own.uniform(2.0, 6.0)
    n = int(density * length * height)
    s, up = rng.uniform(0.0, length, n), rng.uniform(0.0, height, n)
    x, y = (x + s, np.full(n, y)) if along else (np.full(n, x), y + s)
    return np.column_stack([x, y, _height(x, y) + up])
