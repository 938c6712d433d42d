"""The metric at one pose: both clouds sorted into one grid, every pair of points met once."""

import numpy as np

from idem_ros.core import se3
from idem_ros.core.grid import bounds, build_grid, cell_of, room_for, rows_around, within
from idem_ros.core.jit import kernel
from idem_ros.core.moments import TIE, entropy, plus, row_of

MARGIN = 1.0 + 1e-9


def differences(target, source, T_target_source, radius, scale):
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
    clouds = (target, se3.transform_points(T_target_source, source))
    found = [np.zeros((2, len(cloud))) for cloud in clouds]
    met = _where_they_meet(clouds, MARGIN * radius)
    points = np.concatenate([cloud[some] for cloud, some in zip(clouds, met, strict=True)])
    if len(points):
        grid, order = build_grid(points, MARGIN * radius)
        here = _differences(grid, order >= len(met[0]), radius * radius * TIE, scale)
        here[:, order] = here.copy()
        found[0][:, met[0]], found[1][:, met[1]] = np.split(here, [len(met[0])], axis=1)
    return found


def _where_they_meet(clouds, radius):
    """Return the indices of those points of each cloud that q_i of any but zero depends on.

    A ball that holds points of both has its centre within a radius of both clouds' boxes.
    """
    boxes = [bounds(cloud) for cloud in clouds]
    low = np.max([low for low, _ in boxes], axis=0) - 2 * radius
    high = np.min([high for _, high in boxes], axis=0) + 2 * radius
    return [_inside(cloud, low, high) for cloud in clouds]


@kernel
def _inside(points, low, high):
    """Return the indices of the points in a box."""
    found, n = np.empty(len(points) + 1, np.int64), 0
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        found[n] = i  # kept only if it is counted
        n += (
            (low[0] <= x)
            & (x <= high[0])
            & (low[1] <= y)
            & (y <= high[1])
            & (low[2] <= z)
            & (z <= high[2])
        )
    return found[:n].copy()


@kernel
def _differences(grid, is_source, r2, scale):
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


@kernel
def _moments(grid, is_source, r2):
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
            n = within(x, y, z, points, max(rows[k, 0], i + 1), rows[k, 1], r2, found, n)
        own = np.int64(is_source[i])
        moments[i, own, 0] += 1.0
        for c in range(n):
            j = np.uint64(found[c])
            d = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
            _add(moments[i, np.int64(is_source[j])], d, 1.0)
            _add(moments[j, own], d, -1.0)
    return moments


@kernel
def _add(m, d, sign):
    dx, dy, dz = d
    m[0] += 1.0
    m[1] += sign * dx
    m[2] += sign * dy
    m[3] += sign * dz
    m[4] += dx * dx
    m[5] += dx * dy
    m[6] += dx * dz
    m[7] += dy * dy
    m[8] += dy * dz
    m[9] += dz * dz
