"""The mean distance to the fourth nearest neighbour, r_4th of the paper."""

import numpy as np
from numba import njit
from scipy.spatial import KDTree

from idem_ros.core.grid import build_grid
from idem_ros.core.jit import JIT

SHELLS = 3  # cells searched on each side of a point's own; the seven are distinct (LEAST_BITS)
SAMPLE = 32  # points whose exact distance finds the size of the cells


def mean_fourth_neighbor_distance(points):
    """Return r_4th of (N, 3) finite points, N >= 5, the point itself not counted.

    Dense parts are searched in cells; for points that stand too far apart for that, scipy's tree.
    """
    sample = points[:: max(len(points) // SAMPLE, 1)]
    cell = float(np.median(_fourth_of_all(sample, points)))
    if cell == 0.0:
        return float(_by_tree(points, points).mean())
    grid, _ = build_grid(points, cell)
    distance = np.empty(len(points))
    _fourth_in_cells(grid, distance)
    lonely = np.isnan(distance)
    if lonely.any():
        distance[lonely] = _by_tree(points, grid.points[lonely])
    return float(distance.mean())


def _by_tree(points, queries):
    return KDTree(points, balanced_tree=False).query(queries, k=[5])[0][:, 0]


@njit(**JIT)
def _fourth_of_all(queries, points):
    """Distance from each query to the fourth nearest of the others, by looking at every point."""
    distance = np.empty(queries.shape[0])
    for i in range(queries.shape[0]):
        best = (np.inf, np.inf, np.inf, np.inf, np.inf)
        for j in range(points.shape[0]):
            best = _nearest_five(best, _squared(queries[i], points[j]))
        distance[i] = np.sqrt(best[4])
    return distance


@njit(**JIT)
def _fourth_in_cells(grid, distance):
    """The same in growing cubes of cells; nan where the largest cube does not settle it."""
    for i in range(grid.points.shape[0]):
        p = grid.points[i]
        best = (np.inf, np.inf, np.inf, np.inf, np.inf)
        distance[i] = np.nan
        for shell in range(1, SHELLS + 1):
            best = _search_shell(p, grid, shell, best)
            if best[4] <= (shell * grid.cell) ** 2:
                distance[i] = np.sqrt(best[4])
                break


@njit(**JIT)
def _search_shell(p, grid, shell, best):
    """Add to the five nearest the points of the cells at a distance of `shell`; 1: up to it."""
    bits, start = grid.bits, grid.start
    mask_x, mask_y, mask_z = (1 << bits[0]) - 1, (1 << bits[1]) - 1, (1 << bits[2]) - 1
    ix = np.int64((p[0] - grid.low[0]) / grid.cell)
    iy = np.int64((p[1] - grid.low[1]) / grid.cell)
    iz = np.int64((p[2] - grid.low[2]) / grid.cell)
    for oz in range(-shell, shell + 1):
        for oy in range(-shell, shell + 1):
            row = ((((iz + oz) & mask_z) << bits[1]) | ((iy + oy) & mask_y)) << bits[0]
            whole = shell == 1 or abs(oz) == shell or abs(oy) == shell
            step = 1 if whole else 2 * shell
            for ox in range(-shell, shell + 1, step):
                c = row + ((ix + ox) & mask_x)
                for j in range(start[c], start[c + 1]):
                    best = _nearest_five(best, _squared(p, grid.points[j]))
    return best


@njit(**JIT)
def _squared(p, o):
    dx, dy, dz = o[0] - p[0], o[1] - p[1], o[2] - p[2]
    return dx * dx + dy * dy + dz * dz


@njit(**JIT)
def _nearest_five(best, d):
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
