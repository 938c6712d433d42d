"""Reduction of a cloud to the voxels of a cubic lattice, each with its raw points' moments."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Integer,
    Integers,
    Integers32,
    Point,
    Points,
    Triple,
    Weights,
)
from idem_ros.core.geometry.grid import bounds
from idem_ros.core.jit import inlined, kernel

NO_TIMES = np.empty(0)


class Voxels(NamedTuple):
    """The occupied voxels, in the order of their first points."""

    mean: Points  # (M, 3) of the raw points
    weights: Weights  # (M, 7): their weight, and their scatter about the mean (xx, ..., zz)


def reduce_to_voxels(
    points: Points, weights: Weights, voxel_size: float, low: Point | None = None
) -> Voxels:
    """Reduce (N, 3) finite points, N >= 1, to voxels of the given edge.

    A point that stands for others goes where it is itself.

    Args:
        points: (N, 3).
        weights: (N, 7) weight and scatter of each point, or (1, 7) of all of them.
        voxel_size: edge of the voxels.
        low: (3,) corner of the first voxel, no point is below; None: the cloud's own.
    """
    low = bounds(points)[0] if low is None else low
    slots, sums, corners = _room(len(points))
    n = _accumulate(points, weights, low, voxel_size, slots, corners, sums, NO_TIMES)
    return _means(n, sums, corners, low, voxel_size)


def reduce_with_times(
    points: Points, weights: Weights, times: Floats, voxel_size: float
) -> tuple[Voxels, Floats]:
    """Return the `Voxels` of `reduce_to_voxels`, and the mean time, (M,), of each.

    times (N,): that of each point.
    """
    low = bounds(points)[0]
    slots, sums, corners = _room(len(points), 11)
    n = _accumulate(points, weights, low, voxel_size, slots, corners, sums, times)
    return _means(n, sums, corners, low, voxel_size), sums[:n, 10] / sums[:n, 0]


def _room(count: int, columns: int = 10) -> tuple[Integers32, Floats, Integers]:
    """Return a hash table for voxels of so many points, their sums and their corners."""
    slots = np.full(1 << (2 * count - 1).bit_length(), -1, np.int32)
    return slots, np.empty((count, columns)), np.empty((count, 3), np.int64)


def _means(n: int, sums: Floats, corners: Integers, low: Point, size: float) -> Voxels:
    mean, reduced = np.empty((n, 3)), np.empty((n, 7))
    _to_means(sums, corners, low, size, mean, reduced)
    return Voxels(mean, reduced)


@kernel
def _accumulate(
    points: Points,
    weights: Weights,
    low: Point,
    size: float,
    slots: Integers32,
    corners: Integers,
    sums: Floats,
    times: Floats,
) -> int:
    """Sum the moments of each voxel about its own middle; a hash table finds the voxel.

    With times (N,), their weighted sum is an eleventh column; (0,): there are none.
    """
    mask = slots.shape[0] - 1
    each = np.int64(weights.shape[0] > 1)
    n, v = np.int64(0), np.int64(0)
    last_x = last_y = last_z = -1
    for i in range(points.shape[0]):
        px, py, pz = points[i, 0] - low[0], points[i, 1] - low[1], points[i, 2] - low[2]
        x, y, z = np.int64(px / size), np.int64(py / size), np.int64(pz / size)
        if x != last_x or y != last_y or z != last_z:
            v = voxel_of(x, y, z, slots, mask, corners, n)
            if v == n:
                for c in range(sums.shape[1]):
                    sums[n, c] = 0.0
                n += 1
            last_x, last_y, last_z = x, y, z
        d = px - (x + 0.5) * size, py - (y + 0.5) * size, pz - (z + 0.5) * size
        _add(sums[v], d, weights[i * each])
        if times.shape[0]:
            sums[v, 10] += weights[i * each, 0] * times[i]
    return n  # pyright: ignore[reportReturnType]  # of which NumPy tells less


@inlined
def voxel_of(
    x: Integer, y: Integer, z: Integer, slots: Integers32, mask: int, corners: Integers, n: Integer
) -> Integer:
    """Return the number of a voxel, n for one not seen before."""
    h = x * 73856093 ^ y * 19349663 ^ z * 83492791
    slot = (h ^ (h >> 15)) & mask
    while True:
        v = slots[slot]
        if v < 0:
            slots[slot] = n
            corners[n, 0], corners[n, 1], corners[n, 2] = x, y, z
            return n
        if corners[v, 0] == x and corners[v, 1] == y and corners[v, 2] == z:
            return np.int64(v)
        slot = (slot + 1) & mask


@inlined
def _add(m: Floats, d: Triple, weight: Floats) -> None:
    (dx, dy, dz), w = d, weight[0]
    m[0] += w
    m[1] += w * dx
    m[2] += w * dy
    m[3] += w * dz
    m[4] += w * dx * dx + weight[1]
    m[5] += w * dx * dy + weight[2]
    m[6] += w * dx * dz + weight[3]
    m[7] += w * dy * dy + weight[4]
    m[8] += w * dy * dz + weight[5]
    m[9] += w * dz * dz + weight[6]


@kernel
def _to_means(
    sums: Floats, corners: Integers, low: Point, size: float, mean: Points, weights: Weights
) -> None:
    """Turn sums about a voxel's middle into mean, count and scatter about the mean."""
    for v in range(mean.shape[0]):
        m = sums[v]
        k, x, y, z = m[0], m[1] / m[0], m[2] / m[0], m[3] / m[0]
        mean[v, 0] = low[0] + (corners[v, 0] + 0.5) * size + x
        mean[v, 1] = low[1] + (corners[v, 1] + 0.5) * size + y
        mean[v, 2] = low[2] + (corners[v, 2] + 0.5) * size + z
        weights[v, 0] = k
        weights[v, 1], weights[v, 2] = m[4] - k * x * x, m[5] - k * x * y
        weights[v, 3], weights[v, 4] = m[6] - k * x * z, m[7] - k * y * y
        weights[v, 5], weights[v, 6] = m[8] - k * y * z, m[9] - k * z * z
