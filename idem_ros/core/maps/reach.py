"""Where a scan can reach in a map: cubes around its points, told by the blocks they lie in."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Indices, Integers, Mask, Points
from idem_ros.core.jit import kernel
from idem_ros.core.maps.map_blocks import Index

CUBES_PER_EDGE = 16  # of a block; half as many for the wider reach of coarse stages
BITS = 20  # of a cube's place along an axis, from the middle of the scan: 1e6 cubes
FARTHEST = 2.0**60  # cubes from the map's zero; more are no whole numbers
# What garbage may cost: scans have 2 or 3 rings, and in a block dozens of the cubes they lie in.
MOST_RINGS, MANY_RINGS, MOST_CUBES = 8, 2, 1 << 20
MOST_BLOCKS, CUBES_OF_A_BLOCK = 512, 16


class Reach(NamedTuple):
    """Cubes of a part of a block's edge."""

    edge: float  # of the blocks
    per_edge: int  # cubes along it
    zero: Integers  # (3,): the cube that codes count from, the first one of its block
    core: Integers  # (n,): codes of the cubes that hold points of the scan
    codes: Integers  # (m,): of these and of those around them, rising
    rings: int  # of cubes beyond them

    @classmethod
    def around(cls, points: Points, edge: float, distance: float, box: Floats) -> Reach:
        """Return the cubes that lie within a distance of points (N, 3), and some farther out.

        Of fewer rings where they would be too many: of points that no scan has.

        box: (2, 3) lowest and highest coordinates; what is a block beyond them has no cubes.
        """
        places = np.clip(points * (CUBES_PER_EDGE / edge), -FARTHEST, FARTHEST)
        cubes = np.floor(places).astype(np.int64)
        middle = np.partition(cubes, len(cubes) // 2, axis=0)[len(cubes) // 2]
        zero = middle // CUBES_PER_EDGE * CUBES_PER_EDGE
        inside = ((points >= box[0] - edge) & (points <= box[1] + edge)).all(axis=1)
        core = _distinct(_coded(cubes[inside] - zero))
        rings = _rings(distance, edge / CUBES_PER_EDGE, len(core))
        return cls(edge, CUBES_PER_EDGE, zero, core, _widened(core, rings), rings)

    @property
    def distance(self) -> float:
        """How far beyond the scan's points all is in reach."""
        return self.rings * self.edge / self.per_edge

    def wider(self, distance: float) -> Reach:
        """Return larger cubes that reach a distance beyond the scan's points."""
        cubes = (_decoded(self.core) + self.zero) // 2
        zero, per_edge = self.zero // 2, self.per_edge // 2
        core = _distinct(_coded(cubes - zero))
        rings = _rings(distance, self.edge / per_edge, len(core))
        return Reach(self.edge, per_edge, zero, core, _widened(core, rings), rings)

    def by_block(self) -> tuple[list[Index], list[Integers]]:
        """Return the blocks that cubes lie in, z slowest, and which cubes of each, x fastest.

        Where they are more than any scan lies in, those that have the most cubes.
        """
        within = (self.per_edge - 1) * (1 | 1 << BITS | 1 << 2 * BITS)  # a cube in its block
        order = np.argsort(self.codes & ~within, kind='stable')
        codes = self.codes[order]
        blocks = codes & ~within
        begins = np.append(np.flatnonzero(np.diff(blocks, prepend=-1)), len(blocks))
        sizes, chosen = np.diff(begins), np.arange(len(begins) - 1)
        most = max(MOST_BLOCKS, len(self.core) // CUBES_OF_A_BLOCK)
        if len(chosen) > most:
            chosen = np.sort(np.argsort(-sizes, kind='stable')[:most])
        x, y, z = _axes(codes & within)
        numbers = (z * self.per_edge + y) * self.per_edge + x
        spans = zip(begins[chosen].tolist(), begins[chosen + 1].tolist(), strict=True)
        of_each = [numbers[begin:end] for begin, end in spans]
        found = (_decoded(blocks[begins[chosen]]) + self.zero) // self.per_edge
        return [(i, j, k) for i, j, k in found.tolist()], of_each


def _rings(distance: float, cube: float, count: int) -> int:
    """Return how many rings of cubes reach a distance, or as many as may be around so many."""
    most = int(((MOST_CUBES / max(count, 1)) ** (1.0 / 3.0) - 1.0) / 2.0)
    most = min(max(most, MANY_RINGS), MOST_RINGS)
    return max(math.ceil(min(distance / cube, most)), 1)


def _coded(cubes: Integers) -> Integers:
    """Return one number for each cube (N, 3), but for those that are farther than any scan is."""
    cubes = cubes[(np.abs(cubes) < 1 << BITS - 2).all(axis=1)] + (1 << BITS - 1)
    return (cubes[:, 2] << 2 * BITS) | (cubes[:, 1] << BITS) | cubes[:, 0]


def _decoded(codes: Integers) -> Integers:
    return np.column_stack(_axes(codes)) - (1 << BITS - 1)


def _axes(codes: Integers) -> tuple[Integers, Integers, Integers]:
    mask = (1 << BITS) - 1
    return codes & mask, codes >> BITS & mask, codes >> 2 * BITS


def _distinct(codes: Integers) -> Integers:
    """Return what `np.unique` does, which takes twenty times as long: it hashes them."""
    return _without_repeats(np.sort(codes))


def _without_repeats(rising: Integers) -> Integers:
    return rising[np.diff(rising, prepend=rising[:1] - 1) != 0]


def _widened(codes: Integers, rings: int) -> Integers:
    for axis in range(3):
        steps = np.arange(-rings, rings + 1) << axis * BITS
        # each step's codes rise: the stable sort merges them, four times as fast as another sorts
        codes = _without_repeats(np.sort((steps[:, None] + codes).ravel(), kind='stable'))
    return codes


@kernel
def rows_in_reach(points: Points, edge: float, per_edge: int, cubes: Mask) -> Indices:
    """Return the rows of a block's points (N, 3), from its corner, that lie in some of its cubes.

    cubes: whether each is in reach, x fastest.
    """
    rows, n, scale, last = np.empty(points.shape[0], np.int32), 0, per_edge / edge, per_edge - 1
    for i in range(points.shape[0]):
        x = min(np.int64(points[i, 0] * scale), last)
        y = min(np.int64(points[i, 1] * scale), last)
        z = min(np.int64(points[i, 2] * scale), last)
        rows[n] = i  # kept only if it is counted
        n += np.int64(cubes[(z * per_edge + y) * per_edge + x])
    return rows[:n].copy()
