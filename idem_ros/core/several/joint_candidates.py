"""Which points of other clouds are near a point: listed once, cloud by cloud."""

import numpy as np

from idem_ros.core.arrays import Indices, Integer, Integers, Integers32, Mask
from idem_ros.core.geometry.grid import Grid, neighbours, room_for
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.metric.candidates import EXPECTED
from idem_ros.core.metric.moments import point_of


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
