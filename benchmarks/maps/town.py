"""A town without end, lot by lot: its surfaces for a LiDAR, and points of them for a map.

What stands on a lot, and which points a map has of it, is a matter of the lot alone: a map of any
size costs what is asked of it.
"""

from functools import lru_cache

import numpy as np

from idem_ros.simulation.furniture import car, lamp_post, tree
from idem_ros.simulation.surfaces import Scene, box, merged, mesh, placed

LOT = 40.0  # [m]: streets run along the edges of lots
STREET = 6.0  # [m] from the edge of a lot to what stands on it
GROUND = 8.0  # [m]: edge of the ground's triangles
DENSITY = 11.0  # points of a map on each square metre of surface
NOISE = 0.02  # [m]: standard deviation of a map's points
LOTS_KEPT = 400


def scene_around(x, y, reach):
    """Return the surfaces of all lots within a reach of a place, one `Scene`."""
    low, high = (np.floor((np.array([x, y]) + sign * reach) / LOT).astype(int) for sign in (-1, 1))
    lots = [(i, j) for i in range(low[0], high[0] + 1) for j in range(low[1], high[1] + 1)]
    return merged([part for lot in lots for part in (_ground(*lot), _standing(*lot))])


def height(x, y):
    """Return z of the ground, as its triangles have it."""
    x, y = np.asarray(x, dtype=float) / GROUND, np.asarray(y, dtype=float) / GROUND
    i, j = np.floor(x), np.floor(y)
    u, v = x - i, y - j
    a, b, c, d = (_node(i + p, j + q) for p, q in ((0, 0), (1, 0), (0, 1), (1, 1)))
    return np.where(
        u + v <= 1.0, a + u * (b - a) + v * (c - a), d + (1 - u) * (c - d) + (1 - v) * (b - d)
    )


class Town:
    """The points of a square of the town, made when they are asked for: a `BlockSource`.

    Args:
        points: how many, about; the square's middle is at (0, 0).

    Attributes:
        bounds: (2, 3) lowest and highest coordinates.
    """

    def __init__(self, points):
        side = LOT * np.sqrt(points / np.mean([len(points_of(i, 2)) for i in range(8)]))
        self.bounds = np.array([[-side, -side, -100.0], [side, side, 200.0]]) / 2

    def points_within(self, low, high):
        """Return the (N, 3) points with low <= p < high."""
        low, high = np.maximum(low, self.bounds[0]), np.minimum(high, self.bounds[1])
        if (low >= high).any():
            return np.empty((0, 3))
        first, last = (np.floor(corner[:2] / LOT).astype(int) for corner in (low - 1, high + 1))
        (i, j), (i_last, j_last) = first.tolist(), last.tolist()
        lots = [points_of(a, b) for b in range(j, j_last + 1) for a in range(i, i_last + 1)]
        points = np.concatenate(lots)
        return points[((points >= low) & (points < high)).all(axis=1)]


@lru_cache(LOTS_KEPT)
def points_of(i, j):
    """Return the (N, 3) points that a map has of a lot."""
    rng = _rng(i, j, 1)
    scene = _standing(i, j)
    n = rng.poisson(DENSITY * LOT**2)
    x, y = rng.uniform(0.0, LOT, (2, n)) + LOT * np.array([[i], [j]])
    ground = np.column_stack([x, y, height(x, y)])
    found = np.concatenate([ground[~_covered(ground, scene)], *_on_surfaces(scene, rng)])
    return found + rng.normal(0.0, NOISE, found.shape)


def _rng(i, j, what):
    return np.random.default_rng([i + 100_000, j + 100_000, what])


def _node(i, j):
    """Height of the ground where triangles meet: hills of some metres, and bumps."""
    bumps = np.sin(12.9898 * i + 78.233 * j) * 43758.5453
    hills = 2.0 * np.sin(i * GROUND / 110.0) + 1.5 * np.cos(j * GROUND / 85.0)
    return hills + 0.06 * (bumps - np.floor(bumps))


def _ground(i, j):
    x, y = (np.arange(LOT / GROUND + 1) * GROUND + LOT * k for k in (i, j))
    x, y = np.meshgrid(x, y, indexing='ij')
    z = _node(x / GROUND, y / GROUND)
    return Scene(triangles=mesh(np.stack([x, y, z], axis=2)))


@lru_cache(LOTS_KEPT)
def _standing(i, j):
    """Houses in the middle of a lot, parked cars, trees and lamps along its streets."""
    rng = _rng(i, j, 0)
    parts = []
    for u, v in ((0, 0), (0, 1), (1, 0), (1, 1)):
        if rng.random() < 0.15:
            continue
        width, depth, tall = rng.uniform(8, 13.5), rng.uniform(8, 13.5), rng.uniform(3.5, 14)
        x, y = STREET + 14 * u + rng.uniform(0, 13.5 - width), STREET + 14 * v + rng.uniform(0, 1)
        low = height(LOT * i + x, LOT * j + y) - 1.0
        parts.append(Scene(boxes=[box((x, y, low), (x + width, y + depth, low + tall))]))
    for build, count in ((car, 4), (tree, 3), (lamp_post, 2)):
        for _ in range(count):
            along, off = rng.uniform(3.0, LOT - 3.0), rng.uniform(3.6, 4.6)
            x, y, yaw = (along, off, 0.0) if rng.random() < 0.5 else (off, along, np.pi / 2)
            z = height(LOT * i + x, LOT * j + y)
            parts.append(placed(build(rng), x, y, float(z), yaw + rng.normal(0.0, 0.05)))
    return placed(merged(parts), LOT * i, LOT * j)


def _covered(points, scene):
    """Which points (N, 3) lie below a box or within a cylinder."""
    covered = np.zeros(len(points), bool)
    for x, y, _, a, b, _, yaw in scene.boxes:
        u, v = _turned(points[:, 0] - x, points[:, 1] - y, -yaw)
        covered |= (np.abs(u) < a) & (np.abs(v) < b)
    return covered


def _turned(x, y, yaw):
    return x * np.cos(yaw) - y * np.sin(yaw), x * np.sin(yaw) + y * np.cos(yaw)


def _on_surfaces(scene, rng):
    """Yield points (n, 3) of each box but its bottom, each cylinder's side and each sphere."""
    for x, y, z, a, b, c, yaw in scene.boxes:
        u, v, w = _on_box(a, b, c, rng)
        u, v = _turned(u, v, yaw)
        yield np.column_stack([x + u, y + v, z + w])
    for x, y, low, high, radius in scene.cylinders:
        n = rng.poisson(DENSITY * 2 * np.pi * radius * (high - low))
        angle = rng.uniform(0.0, 2 * np.pi, n)
        up = rng.uniform(low, high, n)
        yield np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle), up])
    for x, y, z, radius in scene.spheres:
        d = rng.normal(size=(rng.poisson(DENSITY * 4 * np.pi * radius**2), 3))
        yield (x, y, z) + radius * d / np.linalg.norm(d, axis=1, keepdims=True)


def _on_box(a, b, c, rng):
    """Return coordinates of points on the sides and the top of a box of these half sizes."""
    found = []
    for area, fixed in ((4 * b * c, (a, 0, 0)), (4 * a * c, (0, b, 0)), (4 * a * b, (0, 0, c))):
        for sign in (1,) if fixed[2] else (1, -1):
            n = rng.poisson(DENSITY * area)
            p = rng.uniform(-1.0, 1.0, (n, 3)) * (a, b, c)
            axis = int(np.argmax(fixed))
            p[:, axis] = sign * fixed[axis]
            found.append(p)
    return np.concatenate(found).T
