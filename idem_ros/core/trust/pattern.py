"""The lines that a sensor leaves on surfaces: rings, columns of a raster. They move with it.

Where the lines of two clouds lie on each other, the sensor's pattern does, whatever the surfaces.
"""

from collections.abc import Sequence

import numpy as np

from idem_ros.core.arrays import Floats, Indices, Mask, Points
from idem_ros.core.geometry.grid import CELL_MARGIN, Grid, build_grid, neighbours, room_for
from idem_ros.core.jit import kernel
from idem_ros.core.metric.cloud import Neighbourhoods
from idem_ros.core.metric.moments import point_of
from idem_ros.core.metric.noise import LEAST_MEMBERS
from idem_ros.core.trust.surfaces import PLAIN, own_surfaces
from idem_ros.core.workers import ALONE, Workers, in_blocks

LINE = 0.1  # most of the second variance over the greatest
IN_PLANE = 0.15  # of the wider radius: how far off a plane a line may lie
LEVEL = 0.3  # most cosine of its direction to the plane's normal


def pattern_lines(
    cloud: Neighbourhoods, wider: Sequence[tuple[Neighbourhoods, float]], workers: Workers = ALONE
) -> tuple[Points, Points]:
    """Return the mean of balls that hold a line on a plane, and where in that it faces, (n, 3).

    A post is a line, too, but on no plane.

    Args:
        cloud: with balls of the last radius.
        wider: the same one with balls of wider radii, and these: their planes.
        workers: `Workers`.

    Raises:
        OutOfTime: the workers are late.
    """
    lines = in_blocks(len(cloud.own), workers, lambda begin, end: _lines(cloud, slice(begin, end)))
    places, along = (np.concatenate(each) for each in zip(*lines, strict=True))
    facing, found = np.zeros_like(places), np.zeros(len(places), bool)
    for each, radius in wider:
        means, normals, _ = own_surfaces(each, PLAIN)
        if not len(means) or not len(places):
            continue
        which, away = _nearest_within(radius, places, means, workers)
        normal = normals[which]
        off = np.abs(np.einsum('ij,ij->i', places - means[which], normal))
        tilt = np.abs(np.einsum('ij,ij->i', along, normal))
        on: Mask = ~found & (away < radius) & (off < IN_PLANE * radius) & (tilt < LEVEL)
        facing[on] = np.cross(normal[on], along[on])
        found |= on
    facing *= np.sign(np.einsum('ij,ij->i', facing, places))[:, None]  # as surfaces: outwards
    return places[found], facing[found]


def _lines(cloud: Neighbourhoods, chosen: slice) -> tuple[Points, Points]:
    """Return the mean and the direction, (n, 3), of those chosen of the balls that hold a line."""
    own, centres = cloud.own[chosen], cloud.grid.points[chosen]
    many = own[:, 0] >= LEAST_MEMBERS
    own, centres = own[many], centres[many]
    mean = own[:, 1:4] / own[:, :1]
    xx, xy, xz, yy, yz, zz = (own[:, 4:] / own[:, :1]).T
    square = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=1).reshape(-1, 3, 3)
    spread, axes = np.linalg.eigh(square - mean[:, :, None] * mean[:, None])
    is_line = spread[:, 1] <= LINE * spread[:, 2]
    return (centres + mean)[is_line], axes[is_line, :, 2]


def _nearest_within(
    radius: float, places: Points, others: Points, workers: Workers
) -> tuple[Indices, Floats]:
    """Return which of the others, one at least, is nearest to each place, and how near.

    Of a place with none within the radius: any, and inf.
    """
    grid, order = build_grid(np.ascontiguousarray(others), radius * CELL_MARGIN)
    found = in_blocks(
        len(places), workers, lambda begin, end: _nearest(places[begin:end], grid, radius**2)
    )
    which, square = (np.concatenate(each) for each in zip(*found, strict=True))
    return order[which], np.sqrt(square)


@kernel
def _nearest(places: Points, grid: Grid, r2: float) -> tuple[Indices, Floats]:
    """Return which of the grid's points is nearest to each place, and its squared distance."""
    which, least = np.zeros(len(places), np.int64), np.full(len(places), np.inf)
    found, rows = room_for(grid)
    for i in range(len(places)):
        x, y, z = point_of(places, i)
        for c in range(neighbours(x, y, z, grid, r2, found, rows)):
            square = 0.0
            for k in range(3):
                square += (places[i, k] - grid.points[found[c], k]) ** 2
            if square < least[i]:
                which[i], least[i] = found[c], square
    return which, least
