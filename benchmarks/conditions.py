"""The paper's six conditions on a closed, bunny-like surface: independent samplings, no copies."""

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from benchmarks.case import Case
from idem_ros.core.geometry import se3
from idem_ros.simulation.body import (
    BUNNY,
    SIZE,
    random_body,
    remeshed_points,
    surface_points,
)

POINTS = 4000
HOLES, HOLE = 30, 25 / 1597  # how many, and the share of the points that each takes: the paper's
NOISE = 0.25  # of the points, added, anywhere in their bounding box
UNSEEN_SEEDS = range(1000, 1012)  # that no number is chosen on


def condition(name, seed, body=BUNNY):
    """Return the `Case` of one of the paper's conditions, `CONDITIONS`, on fresh samplings."""
    rng = np.random.default_rng([seed, *name.encode()])
    target, source = CONDITIONS[name](rng, body)
    truth = np.eye(4)
    truth[:3, :3] = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    truth[:3, 3] = SIZE * rng.normal(size=3)
    return Case(f'{name} {seed}', target, se3.transform_points(se3.inverse(truth), source), truth)


def of_other_body(name, seed):
    """Return the `Case` of a condition on a body of its own."""
    return condition(name, seed, random_body(np.random.default_rng(seed)))


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
