"""A sweep of a LiDAR that turns and stands still, in the orders in which drivers store one."""

import numpy as np

STAMP = 1_700_000_000_123_456_789
RINGS, COLUMNS, SWEEP = 16, 360, 0.1


def sweep(order='rows', turns=1.0):
    """Points of a spinning LiDAR and their times, column after column or ring after ring."""
    rng = np.random.default_rng(0)
    share = np.repeat(np.arange(COLUMNS) / COLUMNS * turns, RINGS)
    elevation = np.tile(np.radians(np.linspace(-15.0, 15.0, RINGS)), COLUMNS)
    azimuth = -2 * np.pi * share
    directions = np.stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ],
        axis=1,
    )
    points = directions * rng.uniform(2.0, 50.0, (len(share), 1))
    if order == 'rows':
        by_row = np.arange(len(share)).reshape(COLUMNS, RINGS).T.reshape(-1)
        return points[by_row], SWEEP * share[by_row]
    if order == 'shuffled':
        shuffled = rng.permutation(len(share))
        return points[shuffled], SWEEP * share[shuffled]
    return points, SWEEP * share
