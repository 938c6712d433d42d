"""The radii of a registration: Eq. 9, and how wide each stage looks."""

import numpy as np

from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.workers import Workers, in_threads

SAMPLE = 512  # points, at least, that a registration estimates the spacing of a cloud from
STEPS_PER_OCTAVE = 8
# Points that share a cell, on average, from which on voxels bound the time of copies and garbage:
# as given, of which scans have up to 28, and of voxels, up to 5 (13 where they are finer than the
# points are apart); and whatever radius is asked for.
CROWDED, CROWDED_VOXELS, MOST_CROWDED = 30.0, 12.0, 60.0
THINNED = 0.25, 0.25 * 2.0**0.5, 0.5  # of the radius: edges of those voxels, the finest first


def weighted_radius(a: float, target: Cloud, source: Cloud, most: int | None = None) -> float:
    """Return r = a (r_4th(A) n_B + r_4th(B) n_A) / (n_A + n_B) of two `Cloud`s."""
    r_target, r_source = (c.fourth_neighbor_distance(most) for c in (target, source))
    n_target, n_source = len(target), len(source)
    return a * (r_target * n_source + r_source * n_target) / (n_target + n_source)


def wide_radius(target: Cloud, source: Cloud, a: float, workers: Workers) -> float:
    """Return Eq. 9's radius of two `Cloud`s, of a sample; 0 where all points are in one place."""
    in_threads(workers, lambda c: c.fourth_neighbor_distance(SAMPLE), (target, source))
    return weighted_radius(a, target, source, SAMPLE)


def last_radius(target: Cloud, source: Cloud, a: float, workers: Workers) -> float:
    """Return the radius of the last stage: Eq. 9's, or less where one cloud is much denser.

    No more than the geometric mean of the two spacings: Eq. 9 takes the spacing of the sparser
    cloud, over which the dense one resolves a curvature that a ball would average away.
    """
    wide = wide_radius(target, source, a, workers)
    spacings = [cloud.fourth_neighbor_distance(SAMPLE) for cloud in (target, source)]
    return min(a * float(np.sqrt(np.prod(spacings))), wide) or wide


def widest_useful(target: Cloud, source: Cloud, widest: float) -> float:
    """Return the radius beyond which a ball no longer tells one part of a cloud from another."""
    boxes = (cloud.extent() for cloud in (target, source))
    return widest * min(float(np.linalg.norm(high - low)) / 2 for low, high in boxes)


def uncrowded(cloud: Cloud, radius: float, among_voxels: bool, asked: float) -> Cloud:
    """Return a cloud, or its finest voxels of which few enough share a cell.

    Of copies, of clouds far denser than the other, and of tails, whose few far points make a
    radius in which the many are all neighbours.

    Args:
        cloud: `Cloud`.
        radius: of the balls.
        among_voxels: whether all clouds are of voxels.
        asked: how many times as wide as usual the balls are to be.
    """
    few = max(asked, 1.0) ** 2 * (CROWDED_VOXELS if among_voxels else CROWDED)
    most, found = min(few, MOST_CROWDED), cloud
    for edge in THINNED:
        if found.crowding(radius) <= most:
            break
        found = cloud.reduced(edge * radius)
    return found


def rounded(radius: float) -> float:
    """Return a radius rounded to an eighth of an octave.

    A target prepared at one radius then serves every source alike.
    """
    if radius == 0.0:
        return 0.0
    octaves: np.float64 = np.log2(radius)
    return float(2.0 ** (np.round(STEPS_PER_OCTAVE * octaves) / STEPS_PER_OCTAVE))
