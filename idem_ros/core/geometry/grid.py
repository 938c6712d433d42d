"""A cloud sorted into cubic cells, for the neighbours within a radius of at most one cell."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import (
    Cell,
    Indices,
    Integer,
    Integers,
    Integers32,
    Point,
    Points,
    Triple,
)
from idem_ros.core.jit import inlined, kernel

CELLS_PER_POINT = 8  # few periods lie over one another; the table still fits in a core's cache
MOST_ROWS = 18  # three by three of three cells each, and as many that end a period
LEAST_BITS = 3  # eight cells along each axis: the seven around a point never coincide
CELL_MARGIN = 1.0 + 1e-9  # of a radius: rounding must not put a neighbour two cells off


class Grid(NamedTuple):
    """Points sorted by cell, x fastest. Cells repeat periodically: any extent fits in few cells.

    A neighbour from another period is told apart by its distance, so the period costs time where
    it is short, never correctness.
    """

    start: Integers32  # (cells + 1,): first point of each cell
    points: Points  # sorted
    low: Point  # corner of the first cell
    extent: Integers  # (3,): cells along each axis that hold points
    bits: Integers  # (3,): log2 of the period along each axis, in cells
    cell: float


def build_grid(points: Points, cell: float) -> tuple[Grid, Indices]:
    """Sort (N, 3) finite points, N >= 1, into cells of the given edge.

    Returns:
        The grid, and the (N,) order: grid.points = points[order].
    """
    most = max(CELLS_PER_POINT * len(points), 1 << 3 * LEAST_BITS)
    return build_grid_between(points, cell, bounds(points), most)


def build_grid_between(
    points: Points, cell: float, box: tuple[Point, Point], most_cells: int
) -> tuple[Grid, Indices]:
    """Sort points, of which there may be none, into the cells of a box that holds them all.

    In which order the neighbours of a place are met is then a matter of the box and of those
    neighbours, whatever other points there are.

    Args:
        points: (N, 3).
        cell: edge of the cells.
        box: lowest and highest coordinates, (3,) each.
        most_cells: that there are before they repeat.
    """
    low, high = box
    extent, bits, start, order, ordered = _sort_into_cells(points, cell, low, high, most_cells)
    return Grid(start, ordered, low, extent, bits, cell), order


@inlined
def _period_bits(extent: Integers, most_cells: int) -> Integers:
    bits = np.empty(3, np.int64)
    for axis in range(3):
        bits[axis] = max(_bit_length(extent[axis] - 1), LEAST_BITS)
    most = _bit_length(most_cells - 1)
    while bits[0] + bits[1] + bits[2] > most:
        widest = 0  # by hand: np.argmax is long to compile
        for axis in range(1, 3):
            widest = axis if bits[axis] > bits[widest] else widest
        bits[widest] -= 1
    return bits


@inlined
def _bit_length(n: Integer) -> int:
    length = 0
    while n > 0:
        n >>= 1
        length += 1
    return length


@kernel
def bounds(points: Points) -> tuple[Point, Point]:
    """Return the lowest and highest coordinates (3,) of (N, 3) points."""
    ax, ay, az = bx, by, bz = points[0]
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        # not min(), which is slower: it would see to NaN, of which there is none
        ax, ay, az = x if x < ax else ax, y if y < ay else ay, z if z < az else az
        bx, by, bz = x if x > bx else bx, y if y > by else by, z if z > bz else bz
    return np.array([ax, ay, az]), np.array([bx, by, bz])


@kernel
def _sort_into_cells(
    points: Points, cell: float, low: Point, high: Point, most_cells: int
) -> tuple[Integers, Integers, Integers32, Integers32, Points]:
    """Counting sort by cell; points of one cell keep their order."""
    n = points.shape[0]
    extent, inverse_cell = np.empty(3, np.int64), 1.0 / cell
    for axis in range(3):
        extent[axis] = np.int64(np.floor((high[axis] - low[axis]) / cell)) + 1
    bits = _period_bits(extent, most_cells)
    key = np.empty(n, np.int64)
    start = np.zeros((1 << (bits[0] + bits[1] + bits[2])) + 2, np.int32)
    mask_x, mask_y, mask_z = (1 << bits[0]) - 1, (1 << bits[1]) - 1, (1 << bits[2]) - 1
    for i in range(n):
        ix = np.int64((points[i, 0] - low[0]) * inverse_cell)
        iy = np.int64((points[i, 1] - low[1]) * inverse_cell)
        iz = np.int64((points[i, 2] - low[2]) * inverse_cell)
        key[i] = ((((iz & mask_z) << bits[1]) | (iy & mask_y)) << bits[0]) | (ix & mask_x)
        start[key[i] + 2] += 1
    for c in range(2, start.shape[0]):
        start[c] += start[c - 1]
    order, ordered = np.empty(n, np.int32), np.empty((n, 3))
    for i in range(n):
        at = start[key[i] + 1]  # after the loop this is where the next cell starts
        start[key[i] + 1] += 1
        order[at] = i
        ordered[at, 0], ordered[at, 1], ordered[at, 2] = points[i, 0], points[i, 1], points[i, 2]
    return extent, bits, start[:-1], order, ordered


@inlined
def room_for(grid: Grid) -> tuple[Integers32, Integers32]:
    """Return what `neighbours` writes to: indices of points (N + 1,), and rows of cells."""
    return np.empty(len(grid.points) + 1, np.int32), np.empty((MOST_ROWS, 2), np.int32)


@inlined
def neighbours(
    px: float, py: float, pz: float, grid: Grid, r2: float, found: Integers32, rows: Integers32
) -> Integer:
    """Write the indices of the grid's points within sqrt(r2) <= cell of p to found; return count.

    found and rows are of `room_for`.
    """
    ix, iy, iz = cell_of(px, py, pz, grid)
    # Of a place outside the cells beside it are looked at in vain: a test for it and a return
    # would keep the rows' loop from being unrolled, and cost four times as much everywhere.
    ix = min(max(ix, -1), grid.extent[0])
    iy = min(max(iy, -1), grid.extent[1])
    iz = min(max(iz, -1), grid.extent[2])
    n = np.uint64(0)
    for k in range(rows_around((ix, iy, iz), grid, 0, rows)):
        n = within((px, py, pz), grid.points, rows[k, 0], rows[k, 1], r2, found, n)
    return n


@inlined
def cell_of(px: float, py: float, pz: float, grid: Grid) -> Cell:
    """Return the cell of a place, which may lie outside the grid."""
    return (
        np.int64(np.floor((px - grid.low[0]) / grid.cell)),
        np.int64(np.floor((py - grid.low[1]) / grid.cell)),
        np.int64(np.floor((pz - grid.low[2]) / grid.cell)),
    )


@inlined
def rows_around(cell: Cell, grid: Grid, least: Integer, rows: Integers32) -> Integer:
    """Write begin and end of the points around a cell, row by row, to rows; return count.

    Rows that end at or before the index least are left out.
    """
    ix, iy, iz = cell
    start, bits = grid.start, grid.bits
    mask_x, mask_y, mask_z = (1 << bits[0]) - 1, (1 << bits[1]) - 1, (1 << bits[2]) - 1
    first, last = (ix - 1) & mask_x, (ix + 1) & mask_x
    n = 0
    for oz in range(-1, 2):
        for oy in range(-1, 2):
            row = ((((iz + oz) & mask_z) << bits[1]) | ((iy + oy) & mask_y)) << bits[0]
            begin, end = start[row + first], start[row + last + 1]
            if first > last:  # the three cells lie across the end of the period
                rows[n, 0], rows[n, 1] = start[row], end
                n += end > max(start[row], least)
                end = start[row + mask_x + 1]
            rows[n, 0], rows[n, 1] = begin, end
            n += end > max(begin, least)
    return n  # pyright: ignore[reportReturnType]  # an integer, of which NumPy tells less


@inlined
def within(
    p: Triple,
    points: Points,
    begin: Integer,
    end: Integer,
    r2: float,
    found: Integers32,
    n: Integer,
) -> Integer:
    """Write the indices in [begin, end) of points within sqrt(r2) of p to found[n:]; count on."""
    px, py, pz = p
    for j in range(np.uint64(begin), np.uint64(end)):  # unsigned: no look at negative indices
        dx, dy, dz = points[j, 0] - px, points[j, 1] - py, points[j, 2] - pz
        found[n] = j  # kept only if it is counted: no branch to mispredict
        n += np.uint64(dx * dx + dy * dy + dz * dz <= r2)
    return n


@kernel
def crowding(grid: Grid) -> float:
    """Return how many points share the cell of a point, on average."""
    total, start = 0.0, grid.start
    for c in range(start.shape[0] - 1):
        in_cell = float(start[c + 1] - start[c])
        total += in_cell * in_cell
    return total / start[-1]
