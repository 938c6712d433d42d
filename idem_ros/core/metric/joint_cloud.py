"""The metric at one pose: both clouds sorted into one grid, every pair of points met once."""

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Integers,
    Mask,
    Point,
    Points,
    RotationMatrix,
    Transform,
)
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.grid import (
    CELL_MARGIN,
    Grid,
    bounds,
    build_grid,
    cell_of,
    room_for,
    rows_around,
    within,
)
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.metric.entropy import entropy
from idem_ros.core.metric.moments import TIE, add_member, plus, row_of


def differences(
    target: Points, source: Points, T_target_source: Transform, radius: float, scale: float
) -> tuple[Floats, Floats]:
    """Return q_i (Eq. 7), and how many points of the other cloud are in reach, of every point.

    Args:
        target: (N, 3) finite points.
        source: (M, 3) likewise.
        T_target_source: (4, 4) rigid transform.
        radius: of the balls, > 0.
        scale: what lengths are divided by.

    Returns:
        (q, reach) of the target, (2, N), and of the source, (2, M).
    """
    R, t = se3.rotation_and_translation(T_target_source)
    points = _joined(np.array(target), np.array(source), R, t)
    met = _where_they_meet(points, len(target), CELL_MARGIN * radius)
    found = np.zeros((2, len(points)))
    if len(met):
        grid, order = build_grid(points[met], CELL_MARGIN * radius)
        index = met[order]
        of_grid = _differences(grid, index >= len(target), radius * radius * TIE, scale)
        found[:, index] = of_grid
    return found[:, : len(target)], found[:, len(target) :]


@kernel
def _joined(target: Points, source: Points, R: RotationMatrix, t: Point) -> Points:
    n = target.shape[0]
    points = np.empty((n + source.shape[0], 3))
    for i in range(n):
        for c in range(3):
            points[i, c] = target[i, c]
    for i in range(source.shape[0]):
        for c in range(3):
            points[n + i, c] = (
                R[c, 0] * source[i, 0] + R[c, 1] * source[i, 1] + R[c, 2] * source[i, 2] + t[c]
            )
    return points


@kernel
def _where_they_meet(points: Points, n: int, radius: float) -> Integers:
    """Return the indices of those points that q_i of any but zero depends on.

    A ball that holds points of both has its centre within a radius of both clouds' boxes: of the
    first n points, and of the others.
    """
    a_low, a_high = bounds(points[:n])
    b_low, b_high = bounds(points[n:])
    low, high = np.maximum(a_low, b_low) - 2 * radius, np.minimum(a_high, b_high) + 2 * radius
    met, k = np.empty(len(points) + 1, np.int64), 0
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        met[k] = i  # kept only if it is counted
        k += (
            (low[0] <= x)
            & (x <= high[0])
            & (low[1] <= y)
            & (y <= high[1])
            & (low[2] <= z)
            & (z <= high[2])
        )
    return met[:k].copy()


@kernel
def _differences(grid: Grid, is_source: Mask, r2: float, scale: float) -> Floats:
    """Return q_i and the other cloud's points in reach, (2, N), in the order of the grid."""
    moments = _moments(grid, is_source, r2)
    found = np.zeros((2, len(moments)))
    for i in range(len(moments)):
        own, across = np.int64(is_source[i]), 1 - np.int64(is_source[i])
        if moments[i, across, 0] > 0.0:
            alone = row_of(moments[i], own)
            joint = plus(alone, row_of(moments[i], across))
            found[0, i] = entropy(joint, scale) - entropy(alone, scale)
            found[1, i] = moments[i, across, 0]
    return found


@inlined
def _moments(grid: Grid, is_source: Mask, r2: float) -> Floats:
    """Return (N, 2, 10): moments about each point of the target's and the source's in its ball."""
    points = grid.points
    moments = np.zeros((len(points), 2, 10))
    found, rows = room_for(grid)
    last, count = (-1, -1, -1), 0
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        cell = cell_of(x, y, z, grid)
        if cell != last:
            last, count = cell, rows_around(cell, grid, i, rows)
        n = np.uint64(0)
        for k in range(count):
            n = within((x, y, z), points, max(rows[k, 0], i + 1), rows[k, 1], r2, found, n)
        own = np.int64(is_source[i])
        moments[i, own, 0] += 1.0
        for c in range(n):
            j = np.uint64(found[c])
            d = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
            add_member(moments[i, np.int64(is_source[j])], d, 1.0)
            add_member(moments[j, own], d, -1.0)
    return moments
