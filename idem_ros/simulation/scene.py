"""Scenes: triangles, boxes, upright cylinders and spheres; how parts are placed and merged."""

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

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
