"""Reduction of a cloud to the voxels of a cubic lattice, each with its raw points' moments."""

from typing import NamedTuple

import numpy as np
from numba import njit

from idem_ros.core.jit import JIT


class Voxels(NamedTuple):
    """The occupied voxels, in the order of their first points."""

    mean: np.ndarray  # (M, 3) float64
    count: np.ndarray  # (M,) float64: points in each
    scatter: np.ndarray  # (M, 6): sum of (p - mean)(p - mean)^T, upper triangle by rows


def reduce_to_voxels(points, voxel_size):
    """Reduce (N, 3) finite points to voxels of the given edge, from the cloud's own corner."""
    cells = np.floor((points - points.min(axis=0)) / voxel_size).astype(np.int64)
    slots = np.full(1 << (2 * len(points) - 1).bit_length(), -1, np.int64)
    moments = np.zeros((len(points), 10))
    corners = np.empty((len(points), 3), np.int64)
    n = _accumulate(points, cells, slots, corners, moments, voxel_size)
    return _voxels(moments[:n], points.min(axis=0) + (corners[:n] + 0.5) * voxel_size)


def _voxels(moments, origin):
    count = moments[:, 0]
    shift = moments[:, 1:4] / count[:, None]
    outer = shift[:, [0, 0, 0, 1, 1, 2]] * shift[:, [0, 1, 2, 1, 2, 2]]
    return Voxels(origin + shift, count.copy(), moments[:, 4:] - count[:, None] * outer)


@njit(**JIT)
def _accumulate(points, cells, slots, corners, moments, voxel_size):
    """Sum the moments of each voxel about its own middle; a hash table finds the voxel."""
    low = np.array([points[:, 0].min(), points[:, 1].min(), points[:, 2].min()])
    mask = slots.shape[0] - 1
    n = 0
    for i in range(points.shape[0]):
        x, y, z = cells[i, 0], cells[i, 1], cells[i, 2]
        slot = (x * 73856093 ^ y * 19349663 ^ z * 83492791) & mask
        while True:
            v = slots[slot]
            if v < 0:
                v = n
                slots[slot] = v
                corners[v, 0], corners[v, 1], corners[v, 2] = x, y, z
                n += 1
                break
            if corners[v, 0] == x and corners[v, 1] == y and corners[v, 2] == z:
                break
            slot = (slot + 1) & mask
        dx = points[i, 0] - low[0] - (x + 0.5) * voxel_size
        dy = points[i, 1] - low[1] - (y + 0.5) * voxel_size
        dz = points[i, 2] - low[2] - (z + 0.5) * voxel_size
        m = moments[v]
        m[0] += 1.0
        m[1] += dx
        m[2] += dy
        m[3] += dz
        m[4] += dx * dx
        m[5] += dx * dy
        m[6] += dx * dz
        m[7] += dy * dy
        m[8] += dy * dz
        m[9] += dz * dz
    return n
