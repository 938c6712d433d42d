"""Where a scan can reach in a map: cubes around its points, told by the blocks they lie in."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Integers, Points
from idem_ros.core.jit import kernel
from idem_ros.core.maps.map_blocks import Index

PER_EDGE = 4  # cubes along a block's edge: one bit of 64 each
BITS = 20  # of a cube's place along an axis, from the middle of the scan: 1e6 cubes
ALL = np.uint64(2**64 - 1)


class Reach(NamedTuple):
    """Cubes of a quarter of a block's edge."""

    edge: float  # of the blocks
    zero: Integers  # (3,): the cube that codes count from, the first one of its block
    codes: Integers  # (n,): of the cubes, rising

    @classmethod
    def around(cls, points: Points, edge: float, rings: int) -> Reach:
        """Return the cubes that hold points (N, 3), and so many rings of cubes around each."""
        cubes = np.floor(points * (PER_EDGE / edge)).astype(np.int64)
        zero = np.sort(cubes, axis=0)[len(cubes) // 2] // PER_EDGE * PER_EDGE
        return cls(edge, zero, _widened(np.unique(_coded(cubes - zero)), rings))

    def holds(self, points: Points, rings: int) -> bool:
        """Whether it holds points (N, 3) and so many rings of cubes around each."""
        cubes = np.floor(points * (PER_EDGE / self.edge)).astype(np.int64)
        wanted = _widened(np.unique(_coded(cubes - self.zero)), rings)
        return bool(np.isin(wanted, self.codes, assume_unique=True).all())

    def by_block(self) -> dict[Index, np.uint64]:
        """Return the blocks that cubes lie in, z slowest, and which cubes of each: a bit of 64."""
        cubes = _decoded(self.codes)
        inside = cubes & (PER_EDGE - 1)
        bit = (inside[:, 2] * PER_EDGE + inside[:, 1]) * PER_EDGE + inside[:, 0]
        block = (cubes + self.zero) // PER_EDGE
        order = np.lexsort(block.T)
        block, bits = block[order], np.uint64(1) << bit[order].astype(np.uint64)
        begins = np.flatnonzero(np.r_[True, (np.diff(block, axis=0) != 0).any(axis=1)])
        masks = np.bitwise_or.reduceat(bits, begins)
        return {
            (i, j, k): mask for (i, j, k), mask in zip(block[begins].tolist(), masks, strict=True)
        }


def _coded(cubes: Integers) -> Integers:
    """Return one number for each cube (N, 3), but for those that are farther than any scan is."""
    cubes = cubes[(np.abs(cubes) < 1 << BITS - 1).all(axis=1)] + (1 << BITS - 1)
    return (cubes[:, 2] << 2 * BITS) | (cubes[:, 1] << BITS) | cubes[:, 0]


def _decoded(codes: Integers) -> Integers:
    mask = (1 << BITS) - 1
    cubes = np.column_stack([codes & mask, codes >> BITS & mask, codes >> 2 * BITS])
    return cubes - (1 << BITS - 1)


def _widened(codes: Integers, rings: int) -> Integers:
    for axis in range(3):
        steps = np.arange(-rings, rings + 1) << axis * BITS
        codes = np.unique(codes[:, None] + steps)
    return codes


@kernel
def rows_in_reach(points: Points, edge: float, cubes: np.uint64) -> Integers:
    """Return the rows of a block's points (N, 3), from its corner, that lie in some of its cubes.

    cubes: a bit of 64 for each, x fastest.
    """
    rows, n, per_edge = np.empty(points.shape[0], np.int64), 0, PER_EDGE / edge
    for i in range(points.shape[0]):
        x = min(np.int64(points[i, 0] * per_edge), PER_EDGE - 1)
        y = min(np.int64(points[i, 1] * per_edge), PER_EDGE - 1)
        z = min(np.int64(points[i, 2] * per_edge), PER_EDGE - 1)
        bit = np.uint64((z * PER_EDGE + y) * PER_EDGE + x)
        rows[n] = i  # kept only if it is counted
        n += np.int64((cubes >> bit) & np.uint64(1))
    return rows[:n].copy()
