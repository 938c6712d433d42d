"""The mean distance to the fourth nearest neighbour, r_4th of the paper."""

from typing import TypeAlias

import numpy as np

from idem_ros.core.arrays import Floats, Indices, Point, Points
from idem_ros.core.geometry.grid import Grid, build_grid, crowding, neighbours, room_for
from idem_ros.core.jit import inlined, kernel

FEW = 8  # points for which looking at all others costs no more than sorting them into cells
REACH = 1.7  # of the upper quartile of these: nearly all points are settled in the first round
GROWTH = 3.0
CROWDED = (
    200.0  # points that share a cell, on average: with more narrower ones are looked in first
)
# An estimate leaves out what is this many times as far as all but a quarter of the points are:
# each of a percent of strays has a voxel of its own.
STRAY, STRAY_SHARE = 30.0, 4
_Five: TypeAlias = tuple[float, float, float, float, float]  # squared distances, the least first

LEAST_REACH = 1e-9  # of the extent, where most points are copies


def mean_fourth_neighbor_distance(points: Points, most: int | None = None) -> float:
    """Return r_4th of (N, 3) finite points, N >= 5, the point itself not counted.

    most: an estimate from every n-th point, at least so many, is enough; copies and strays are
        left out (half the points in one place would halve it, one at 1e6 m be all of it). None:
        from all.
    """
    queries = np.ascontiguousarray(points[:: 1 if most is None else max(len(points) // most, 1)])
    distance = np.full(len(queries), np.nan)
    few = np.arange(0, len(queries), max(len(queries) // FEW, 1))
    _look_at_all(queries, points, few, distance)
    lower_quartile, upper_quartile = np.sort(distance[few])[[len(few) // 4, 3 * len(few) // 4]]
    reach = max(REACH * upper_quartile, LEAST_REACH * np.ptp(points))
    if reach == 0.0:
        return 0.0
    open_ = np.flatnonzero(np.isnan(distance))
    if len(open_) > FEW:
        grid = _first_grid(points, reach, REACH * lower_quartile)
        reach = grid.cell
        while True:
            _look_in_cells(queries, grid, reach**2, open_, distance)
            open_ = open_[np.isnan(distance[open_])]
            if len(open_) <= FEW:
                break
            reach *= GROWTH
            grid, _ = build_grid(points, reach)
    _look_at_all(queries, points, open_, distance)
    if most is not None and distance.any():
        apart = np.sort(distance[distance > 0.0])
        usual = apart[-1 - len(apart) // STRAY_SHARE]
        distance = distance[(distance > 0.0) & (distance <= STRAY * usual)]
    return float(distance.mean())


def _first_grid(points: Points, reach: float, narrower: float) -> Grid:
    """Return a `Grid` of cells of a reach; of a narrower one, where too many share a cell.

    The reach of the few that lie apart would find most of the others.
    """
    grid, _ = build_grid(points, reach)
    if 0.0 < narrower < reach and crowding(grid) > CROWDED:
        grid, _ = build_grid(points, narrower)
    return grid


@kernel
def _look_at_all(queries: Points, points: Points, chosen: Indices, distance: Floats) -> None:
    """Fill, for the chosen queries, the distance to the fourth nearest of the others."""
    for i in chosen:
        best = (np.inf, np.inf, np.inf, np.inf, np.inf)
        for j in range(points.shape[0]):
            best = _five_nearest(best, _squared(queries[i], points[j]))
        distance[i] = np.sqrt(best[4])


@kernel
def _look_in_cells(
    queries: Points, grid: Grid, r2: float, chosen: Indices, distance: Floats
) -> None:
    """Do the same for those that have five points within sqrt(r2), themselves included."""
    found, rows = room_for(grid)
    for i in chosen:
        p = queries[i]
        n = neighbours(p[0], p[1], p[2], grid, r2, found, rows)
        if n >= 5:
            best = (np.inf, np.inf, np.inf, np.inf, np.inf)
            for c in range(n):
                best = _five_nearest(best, _squared(p, grid.points[found[c]]))
                if best[4] == 0.0:  # copies of one point: none can be nearer
                    break
            distance[i] = np.sqrt(best[4])


@inlined
def _squared(p: Point, o: Point) -> float:
    dx, dy, dz = o[0] - p[0], o[1] - p[1], o[2] - p[2]
    return dx * dx + dy * dy + dz * dz


@inlined
def _five_nearest(best: _Five, d: float) -> _Five:
    """Insert d in the five smallest, in order; the first is the point itself."""
    a, b, c, e, f = best
    if d >= f:
        return best
    if d < a:
        return (d, a, b, c, e)
    if d < b:
        return (a, d, b, c, e)
    if d < c:
        return (a, b, d, c, e)
    if d < e:
        return (a, b, c, d, e)
    return (a, b, c, e, d)
