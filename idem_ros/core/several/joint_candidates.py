"""Which points of several clouds have a ball, and which points of other clouds are near one.

K clouds put K times as many points into a ball as one does, and K times as many balls around them,
which differ in little. One of each K / COMPANY, counting as many times, leaves as many balls to a
place as COMPANY clouds have there: a step then takes time by the points, not by their square.
What is near is listed once, cloud by cloud.
"""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Indices, Integer, Integers, Integers32, Mask
from idem_ros.core.geometry.grid import Grid, neighbours, room_for
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.metric.candidates import EXPECTED
from idem_ros.core.metric.moments import point_of

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


@kernel
def others_around(
    grid: Grid, cloud: Integers32, centres: Indices, r2: float, together: Mask
) -> tuple[Integers, Integers32]:
    """Return the candidates of some of the grid's points: those near, but of other clouds.

    Of each point cloud by cloud. Mark (K, K) which clouds share one of the balls.
    """
    count = together.shape[0]
    first = np.empty(len(centres) + 1, np.int64)
    member = np.empty(EXPECTED * len(centres), np.int32)
    found, rows = room_for(grid)
    place, seen = np.zeros(count, np.int64), np.empty(count, np.int32)
    first[0] = at = 0
    i: int
    for k, i in enumerate(centres):
        x, y, z = point_of(grid.points, i)
        near = np.int64(neighbours(x, y, z, grid, r2, found, rows))
        while at + near > member.shape[0]:
            member = np.concatenate((member, np.empty_like(member)))
        clouds = 0
        for c in range(np.uint64(near)):
            b = cloud[found[c]]
            seen[clouds] = b  # kept only if it is counted
            clouds += place[b] == 0
            place[b] += 1
        at = _place_by_cloud(cloud, found[:near], seen[:clouds], cloud[i], (member, place), at)
        _mark(seen[:clouds], together)
        first[k + 1] = at
    return first, member[:at].copy()


@inlined
def _place_by_cloud(
    cloud: Integers32,
    found: Integers32,
    seen: Integers32,
    own: Integer,
    into: tuple[Integers32, Integers],
    at: Integer,
) -> Integer:
    """Write those found, but of their own cloud, to member from `at` on; return where it ends.

    into: member, and how many are of each cloud (K,), which is left at zero.
    """
    member, place = into
    for b in seen:
        n = np.int64(place[b])
        place[b] = at
        if b != own:
            at += n
    for j in found:
        b = cloud[j]
        if b != own:
            member[place[b]] = j
            place[b] += 1
    for b in seen:
        place[b] = 0
    return at


@inlined
def _mark(seen: Integers32, together: Mask) -> None:
    for p in range(len(seen)):
        for q in range(p):
            together[min(seen[p], seen[q]), max(seen[p], seen[q])] = True
