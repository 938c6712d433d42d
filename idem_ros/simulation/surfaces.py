"""Scenes: triangles, boxes, upright cylinders and spheres; how parts are placed and merged."""

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from idem_ros.core.geometry.se3 import transform_points, translation


def _rows(*shape):
    return field(default=(), metadata={'shape': shape})


@dataclass(frozen=True, eq=False)
class Scene:
    """Surfaces that rays can hit, in metres, z up; the arrays are float64 and read-only.

    A scene is also the unit it is built from: a car is a scene of its own, then `placed` and
    `merged`. Every surface has two sides: from inside, a box is a room.

    Attributes:
        triangles: (n, 3, 3) corners.
        boxes: (n, 7) centre x y z, half sizes x y z, yaw [rad] about z through the centre.
        cylinders: (n, 5) x, y, lower z, upper z, radius; upright, closed at both ends.
        spheres: (n, 4) centre x y z, radius.
        route: (m, 3) the ground line that a sensor is carried along, empty for a part.
    """

    triangles: Any = _rows(3, 3)  # given as any rows
    boxes: Any = _rows(7)
    cylinders: Any = _rows(5)
    spheres: Any = _rows(4)
    route: Any = _rows(3)

    def __post_init__(self):
        for kind in fields(self):
            rows = np.array(getattr(self, kind.name), dtype=np.float64)
            rows = rows.reshape(-1, *kind.metadata['shape'])
            rows.flags.writeable = False
            object.__setattr__(self, kind.name, rows)


def merged(parts, route=()):
    """Return one scene of all surfaces of `parts`, with a route of its own."""
    parts = list(parts)
    surfaces = {
        kind.name: np.concatenate([getattr(part, kind.name) for part in (Scene(), *parts)])
        for kind in fields(Scene)
        if kind.name != 'route'
    }
    return Scene(**surfaces, route=route)


def placed(part, x, y, z=0.0, yaw=0.0):
    """Return a part turned by `yaw` [rad] about the z axis, then moved to (x, y, z) [m]."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    T = translation(np.array([x, y, z]))
    T[:2, :2] = (cos, -sin), (sin, cos)
    boxes, cylinders, spheres = part.boxes.copy(), part.cylinders.copy(), part.spheres.copy()
    boxes[:, :3] = transform_points(T, boxes[:, :3])
    boxes[:, 6] += yaw
    cylinders[:, :3] = transform_points(T, cylinders[:, :3])
    cylinders[:, 3] += z
    spheres[:, :3] = transform_points(T, spheres[:, :3])
    triangles, route = (transform_points(T, points) for points in (part.triangles, part.route))
    return Scene(triangles, boxes, cylinders, spheres, route)


def box(low, high, yaw=0.0):
    """Return the box row between two opposite corners, turned by `yaw` about its own centre."""
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    return (*(low + high) / 2, *(high - low) / 2, yaw)


def mesh(vertices):
    """Return the (2 (m - 1) (k - 1), 3, 3) triangles of a grid of (m, k, 3) vertices."""
    a, b = vertices[:-1, :-1], vertices[1:, :-1]
    c, d = vertices[:-1, 1:], vertices[1:, 1:]
    corners = np.stack([np.stack([a, b, c], axis=2), np.stack([d, c, b], axis=2)])
    return corners.reshape(-1, 3, 3)


def curve(corners, step_m=0.1):
    """Return (m, 2) points, about `step_m` [m] apart, of a smooth line through (k, 2) corners."""
    corners = np.asarray(corners, dtype=np.float64)
    chords = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(chords)])
    spline = CubicSpline(length, corners)
    return spline(np.linspace(0.0, length[-1], round(length[-1] / step_m) + 1))


class Floor:
    """A rectangle seen from above, and the circles of it that are taken."""

    def __init__(self, low, high, route, clear_m):
        """Take what is nearer than `clear_m` [m] to the (m, 2) route.

        Args:
            low: (2,) least x and y where something may stand [m].
            high: (2,) greatest x and y [m].
            route: (m, 2) points of the line that stays free.
            clear_m: free distance to either side of it [m].
        """
        self.low, self.high = np.asarray(low), np.asarray(high)
        self.taken = [(x, y, clear_m) for x, y in route]

    def take(self, rng, radius, tries=30):
        """Return the x, y of a free circle, from now on taken, or None where none was found."""
        taken = np.array(self.taken)
        for x, y in rng.uniform(self.low + radius, self.high - radius, (tries, 2)):
            apart = np.hypot(taken[:, 0] - x, taken[:, 1] - y)
            if (apart > taken[:, 2] + radius).all():
                self.taken.append((x, y, radius))
                return float(x), float(y)
        return None
