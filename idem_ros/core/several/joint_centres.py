"""Which points of several clouds have a ball: where many clouds overlap not all, but evenly.

K clouds put K times as many points into a ball as one does, and K times as many balls around them,
which differ in little. One of each K / COMPANY, counting as many times, leaves as many balls to a
place as COMPANY clouds have there: a step then takes time by the points, not by their square.
"""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Indices, Integers, Integers32
from idem_ros.core.geometry.grid import Grid
from idem_ros.core.jit import kernel

# Clouds at a place, of which every point has a ball: of LiDAR scans that all overlap errors are
# 1.04 times what they are without this, and 1.25 times with 2.0; of rings the same with any.
COMPANY = 4.0


class Centres(NamedTuple):
    """Points around which there are balls."""

    place: Indices  # (C,): among all points, in the order of the grid
    weight: Floats  # (C,): how many balls each of theirs stands for


def all_centres(count: int) -> Centres:
    """Return the `Centres` of a ball around each of `count` points."""
    return Centres(np.arange(count), np.ones(count))


def thinned(grid: Grid, cloud: Integers32, number: Integers, most: float, count: int) -> Floats:
    """Return how many balls that of each point stands for, (N,); 0.0: it has none.

    Args:
        grid: of the points of all clouds.
        cloud: (N,) which one each is of, in the order of the grid.
        number: (N,) of each within its own cloud, likewise; points of like numbers are near one
            another.
        most: how many are to be left, about.
        count: of the clouds.
    """
    strides = _strides(grid, cloud, COMPANY, count)
    left = float((1.0 / strides).sum())
    if left > most:
        strides *= np.ceil(left / most)
    return np.where((number + cloud) % strides.astype(np.int64) == 0, strides, 0.0)


@kernel
def _strides(grid: Grid, cloud: Integers32, company: float, count: int) -> Floats:
    """Return, for each point, by how many clouds share its cell: one of how many is left."""
    strides = np.empty(cloud.shape[0])
    latest = np.full(count, -1, np.int64)  # cell in which each cloud was met
    for c in range(grid.start.shape[0] - 1):
        clouds = 0
        for i in range(grid.start[c], grid.start[c + 1]):
            clouds += latest[cloud[i]] != c
            latest[cloud[i]] = c
        for i in range(grid.start[c], grid.start[c + 1]):
            strides[i] = max(np.floor(clouds / company), 1.0)
    return strides
