"""The paper's six conditions on a closed, bunny-like surface: independent samplings, no copies."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from idem_ros.benchmarks.case import Case
from idem_ros.core import se3

POINTS = 4000
SIZE = 0.06  # [m], mean radius of the body
CROWDING = 12  # candidates that a point is chosen from
HOLES, HOLE = 30, 25 / 1597  # how many, and the share of the points that each takes: the paper's
NOISE = 0.25  # of the points, added, anywhere in their bounding box


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
    tree = cKDTree(points)
    area = np.pi * np.mean(tree.query(points, 11)[0][:, 10] ** 2) * len(points) / 10
    apart = np.sqrt(0.7 * area / count)  # what random sequential packing needs for that count
    kept, free = [], np.ones(len(points), bool)
    for i in range(len(points)):
        if free[i]:
            kept.append(i)
            free[tree.query_ball_point(points[i], apart)] = False
    return points[kept]


def condition(name, seed, body=BUNNY):
    """Return the `Case` of one of the paper's conditions, `CONDITIONS`, on fresh samplings."""
    rng = np.random.default_rng([seed, *name.encode()])
    target, source = CONDITIONS[name](rng, body)
    truth = np.eye(4)
    truth[:3, :3] = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    truth[:3, 3] = SIZE * rng.normal(size=3)
    return Case(f'{name} {seed}', target, se3.transform_points(se3.inverse(truth), source), truth)


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


def _pair(sample=surface_points, count=POINTS):
    return lambda rng, body: (surface_points(rng, POINTS, body), sample(rng, count, body))


def _noisy(rng, body):
    return tuple(_with_noise(rng, surface_points(rng, POINTS, body)) for _ in range(2))


def _with_noise(rng, points):
    low, high = points.min(axis=0), points.max(axis=0)
    return np.concatenate([points, rng.uniform(low, high, (int(NOISE * len(points)), 3))])


def _holed(rng, body):
    return tuple(_with_holes(rng, surface_points(rng, POINTS, body)) for _ in range(2))


def _with_holes(rng, points):
    for _ in range(HOLES):
        seed = points[rng.integers(len(points))]
        _, nearest = cKDTree(points).query(seed, int(HOLE * POINTS))
        points = np.delete(points, nearest, axis=0)
    return points


def _overlapping(share, sample=surface_points, count=POINTS):
    """Cut both clouds by parallel planes so that `share` of each lies in the other."""
    part = 1.0 / (2.0 - share)  # of the whole surface, that each keeps

    def cut(rng, body):
        direction = rng.normal(size=3)
        target, source = surface_points(rng, POINTS, body), sample(rng, count, body)
        along_target, along_source = target @ direction, source @ direction
        return (
            target[along_target <= np.quantile(along_target, part)],
            source[along_source >= np.quantile(along_source, 1.0 - part)],
        )

    return cut


CONDITIONS = {
    'density 10:1': _pair(count=POINTS // 10),
    'noise 25 %': _noisy,
    'holes': _holed,
    'overlap 50 %': _overlapping(0.5),
    'overlap 30 %': _overlapping(0.3),
    'similar': _pair(remeshed_points, int(0.6 * POINTS)),
    'similar, overlap 50 %': _overlapping(0.5, remeshed_points, int(0.6 * POINTS)),
}
"""The paper's conditions by name; each makes (target, source) of a `Body`, not yet displaced."""
