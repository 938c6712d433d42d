"""Closed surfaces by one formula, a bunny-like one among them, and samplings of them."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

SIZE = 0.06  # [m], mean radius of the body
CROWDING = 12  # candidates that a point is chosen from


class Body(NamedTuple):
    """A closed surface."""

    stretch: tuple  # of the axes
    bumps: tuple  # direction, height and width (variance of the angle) of what stands out of it


BUNNY_BUMPS = (
    ((0.8, 0.0, 0.6), 0.45, 0.12),  # head
    ((0.55, 0.25, 0.8), 0.75, 0.012),  # ears
    ((0.45, -0.3, 0.85), 0.65, 0.014),
    ((-0.95, 0.05, -0.2), 0.22, 0.03),  # tail
    ((-0.5, 0.7, -0.5), 0.28, 0.08),  # haunches
    ((-0.55, -0.72, -0.42), 0.22, 0.09),
    ((0.7, 0.35, -0.6), 0.3, 0.025),  # paws
    ((0.66, -0.4, -0.64), 0.26, 0.022),
)
BUNNY = Body((1.15, 0.8, 0.95), BUNNY_BUMPS)


def random_body(rng):
    """Return a `Body` of another shape: broad and narrow bumps in any direction."""
    bumps = tuple(
        (tuple(rng.normal(size=3)), rng.uniform(0.15, 0.7), float(np.exp(rng.uniform(-4.4, -1.9))))
        for _ in range(rng.integers(6, 12))
    )
    return Body(tuple(rng.uniform(0.7, 1.25, 3)), bumps)


def surface_points(rng, count, body=BUNNY):
    """Return (count, 3) points of a `Body`'s surface, evenly likely per area, none twice."""
    direction = rng.normal(size=(CROWDING * count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    points, area = _on_surface(direction, body)
    return points[rng.choice(len(points), count, replace=False, p=area / area.sum())]


def remeshed_points(rng, count, body=BUNNY):
    """Return about `count` points of a `Body`'s surface at even distances, as remeshed."""
    points = surface_points(rng, CROWDING * count, body)
    tree = KDTree(points)
    area = np.pi * np.mean(tree.query(points, 11)[0][:, 10] ** 2) * len(points) / 10
    apart = np.sqrt(0.7 * area / count)  # what random sequential packing needs for that count
    kept, free = [], np.ones(len(points), bool)
    for i in range(len(points)):
        if free[i]:
            kept.append(i)
            free[tree.query_ball_point(points[i], apart)] = False
    return points[kept]


def _on_surface(direction, body):
    """Return the points in these (n, 3) unit directions and the area per solid angle there."""
    stretch = np.array(body.stretch)
    radius, slope = np.ones(len(direction)), np.zeros_like(direction)
    for toward, height, width in body.bumps:
        toward = np.array(toward) / np.linalg.norm(toward)
        bump = height * np.exp((direction @ toward - 1.0) / width)
        radius += bump
        slope += (bump / width)[:, None] * toward
    slope -= np.sum(slope * direction, axis=1, keepdims=True) * direction
    # The normal of x = radius(d) d is radius (radius d - slope); a linear map S turns areas by
    # det S S^-T.
    normal = radius[:, None] * (radius[:, None] * direction - slope)
    area = np.linalg.norm(normal / stretch, axis=1) * stretch.prod()
    return SIZE * stretch * radius[:, None] * direction, area
