"""The 20 pairs of table 2 of two samplings that are independent: no point is common to both."""

from dataclasses import replace

import numpy as np

from idem_ros.experiments.conditions import (
    DOWNSAMPLED,
    STAIRS_PARTIAL,
    Case,
    cropped,
    make_case,
    stairs_scan,
)
from idem_ros.experiments.models import POINTS, midpoints, surface_samples

MOVED = 0.5  # the scanner's stations for the second scan, along x and y [m]


def independent_case(name, model, seed=0):
    """Return the `Case` of a name of `case_names`, made of two samplings.

    Each cloud is made as `make_case` makes it, but the source from a second B_0.

    Args:
        name: as in table 2.
        model: `Model` in place of B_0.
        seed: the same seed gives the same clouds.
    """
    if name == 'S1-S2':
        return _stairs(name, seed)
    of_target, of_source = (replace(model, points=b0) for b0 in samplings(model, seed))
    source = make_case(name, of_source, seed)
    return replace(source, target=make_case(name, of_target, seed).target)


def samplings(model, seed=0):
    """Return two (1597, 3) samplings of the model's surface.

    Of its triangles, evenly likely per area; where it has none, two disjoint choices of the
    midpoints between neighbouring vertices.
    """
    rng = np.random.default_rng([seed, POINTS, 2])
    if len(model.faces):
        return tuple(surface_samples(model, POINTS, rng) for _ in range(2))
    chosen = rng.permutation(midpoints(model.vertices))
    return chosen[:POINTS], chosen[POINTS : 2 * POINTS]


def _stairs(name, seed):
    rng = np.random.default_rng([seed, *name.encode()])
    scans = (
        stairs_scan(rng, count, moved)
        for count, moved in zip(DOWNSAMPLED, (0.0, MOVED), strict=True)
    )
    return Case(name, 'two simulated scans of the stairs', *cropped(*scans, STAIRS_PARTIAL), 'm')
