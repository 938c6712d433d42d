"""The radii of a registration: Eq. 9, and how wide each stage looks."""

import numpy as np

from idem_ros.core.blocks import in_threads
from idem_ros.core.grid import bounds

SAMPLE = 512  # points, at least, that a registration estimates the spacing of a cloud from
VOXELS = 0.8  # of the last radius: their raw points tell a surface's direction in a narrower ball
STEPS_PER_OCTAVE = 8
WIDEST = 0.75  # of half the diagonal of the smaller cloud's box; a wider ball holds all of it


def weighted_radius(a, target, source, most=None):
    """Return r = a (r_4th(A) n_B + r_4th(B) n_A) / (n_A + n_B) of two `Cloud`s."""
    r_target, r_source = (c.fourth_neighbor_distance(most) for c in (target, source))
    n_target, n_source = len(target), len(source)
    return a * (r_target * n_source + r_source * n_target) / (n_target + n_source)


def stage_radii(target, source, config):
    """Return the radius of each stage of a registration; zeros for points all in one place.

    Multiples of Eq. 9's, from a sample of both clouds. The last stage looks no wider than the
    geometric mean of the two spacings: where one cloud is much denser, Eq. 9 takes the spacing of
    the other, over which the dense one resolves a curvature that a ball would average away.
    Among voxels it looks less wide, for the same reason.

    Rounded to an eighth of an octave: a target prepared at one radius serves every source alike.
    """
    clouds = (target, source)
    spacings = in_threads(config.threads, lambda c: c.fourth_neighbor_distance(SAMPLE), clouds)
    wide = weighted_radius(config.a, target, source, SAMPLE)
    narrow = config.a * float(np.sqrt(np.prod(spacings)))
    *earlier, last = config.radius_schedule
    last *= VOXELS if len(target.raw) and len(source.raw) else 1.0
    radii = [factor * wide for factor in earlier] + [last * (min(narrow, wide) or wide)]
    return [rounded(radius) for radius in radii]


def widest_useful(target, source):
    """Return the radius beyond which a ball no longer tells one part of a cloud from another."""
    boxes = (bounds(cloud.points) for cloud in (target, source))
    return WIDEST * min(float(np.linalg.norm(high - low)) / 2 for low, high in boxes)


def rounded(radius):
    """Return a radius rounded to an eighth of an octave."""
    if radius == 0.0:
        return 0.0
    return float(2.0 ** (np.round(STEPS_PER_OCTAVE * np.log2(radius)) / STEPS_PER_OCTAVE))
