"""A cloud sorted into cubic cells, for all neighbours within a radius of at most one cell."""

from typing import NamedTuple

import numpy as np
from numba import njit

from idem_ros.core.jit import JIT

CELLS_PER_POINT = 4
LEAST_BITS = 2  # four cells along each axis: the three around a point never coincide


class Grid(NamedTuple):
    """Points sorted by cell, x fastest. Cells repeat periodically: any extent fits in few cells.

    A neighbour from another period is told apart by its distance, so the period costs time where
    it is short, never correctness.
    """

    start: np.ndarray  # (cells + 1,) int64: first point of each cell
    points: np.ndarray  # (N, 3) float64, sorted
    weight: np.ndarray  # (N,) float64: raw points that each stands for
    scatter: np.ndarray  # (N, 6) sum of outer products of these about their mean, or (0, 6)
    low: np.ndarray  # (3,) float64: corner of the first cell
    extent: np.ndarray  # (3,) int64: cells along each axis that hold points
    bits: np.ndarray  # (3,) int64: log2 of the period along each axis, in cells
    cell: float


def build_grid(points, weight, scatter, cell):
    """Sort points into cells of the given edge.

    Args:
        points: (N, 3) float64, finite, N >= 1.
        weight: (N,) float64.
        scatter: (N, 6) float64, or (0, 6) where every point stands for itself.
        cell: edge of a cell, > 0; the largest radius that can be asked for.

    Returns:
        The grid, and the (N,) int64 order: grid.points = points[order].
    """
    low = points.min(axis=0)
    extent = np.floor((points.max(axis=0) - low) / cell).astype(np.int64) + 1
    bits = _period_bits(extent, len(points))
    start, order = _sort_into_cells(points, low, 1.0 / cell, bits)
    scatter = scatter[order] if len(scatter) else scatter
    return Grid(start, points[order], weight[order], scatter, low, extent, bits, cell), order


def _period_bits(extent, n_points):
    bits = np.maximum([int(n - 1).bit_length() for n in extent], LEAST_BITS)
    most = max(int(CELLS_PER_POINT * n_points - 1).bit_length(), 3 * LEAST_BITS)
    while bits.sum() > most:
        bits[np.argmax(bits)] -= 1
    return bits


@njit(**JIT)
def _sort_into_cells(points, low, inverse_cell, bits):
    """Counting sort by cell; points of one cell keep their order."""
    n = points.shape[0]
    key = np.empty(n, np.int64)
    start = np.zeros((1 << (bits[0] + bits[1] + bits[2])) + 1, np.int64)
    mask_x, mask_y, mask_z = (1 << bits[0]) - 1, (1 << bits[1]) - 1, (1 << bits[2]) - 1
    for i in range(n):
        ix = np.int64((points[i, 0] - low[0]) * inverse_cell)
        iy = np.int64((points[i, 1] - low[1]) * inverse_cell)
        iz = np.int64((points[i, 2] - low[2]) * inverse_cell)
        key[i] = ((((iz & mask_z) << bits[1]) | (iy & mask_y)) << bits[0]) | (ix & mask_x)
        start[key[i] + 1] += 1
    for c in range(1, start.shape[0]):
        start[c] += start[c - 1]
    order = np.empty(n, np.int64)
    filled = start[:-1].copy()
    for i in range(n):
        order[filled[key[i]]] = i
        filled[key[i]] += 1
    return start, order
