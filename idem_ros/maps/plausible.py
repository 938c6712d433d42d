"""What its points alone tell of a map: whether it is in metres, and what is no part of it."""

import numpy as np
from scipy.spatial import KDTree

from idem_ros.core.geometry.grid import bounds
from idem_ros.maps.source import UnusableMap

PLACES = 8  # of which the densest counts
AROUND = 32.0  # [m] of a place, along each axis
SAMPLE = 100  # points of a place
WIDEST_SPACING = 5.0  # [m]: the sparsest maps have a tenth of it where they are densest

SHARE = 0.01  # of the points at each end say nothing of the map's extent
TIMES, MARGIN = 10.0, 10_000.0  # of its extent, and [m] beyond it
HALF = 1000.0  # times as far from the middle as half of the points
SAMPLE_OF_ALL = 10_000


def require_metres(points, within, name):
    """Refuse a map whose points stand too far apart to be in metres.

    Args:
        points: (N, 3) of the map, or of a part of it.
        within: gives those of a box, as `MapSource.points_within` does.
        name: of the map.

    Raises:
        UnusableMap: it is in millimetres, or one of strays.
    """
    places = points[:: max(len(points) // PLACES, 1)]
    spacing = min(_spacing(within(place - AROUND, place + AROUND)) for place in places)
    if spacing > WIDEST_SPACING:
        found = f'{spacing:.3g} apart' if np.isfinite(spacing) else f'{AROUND:g} and more apart'
        raise UnusableMap(
            f'{name}: its points stand {found} where they are densest, and those of a map in '
            f'metres less than {WIDEST_SPACING:g}; is it in millimetres?'
        )


def _spacing(points):
    """Return the median distance to the fourth neighbour; infinite where there is none."""
    some = points[:: max(len(points) // SAMPLE, 1)]
    return float(np.median(KDTree(points).query(some, 5)[0][:, 4])) if len(points) else np.inf


def near_the_rest(points, counts=None):
    """Return (N,) bool: which points, or tiles of several, are not far from all the rest.

    Args:
        points: (N, 3).
        counts: (N,) how many points each stands for; None: one.
    """
    few = points[:: max(len(points) // SAMPLE_OF_ALL, 1)] if counts is None else points
    low, middle, high = _quantiles(few, counts, (SHARE, 0.5, 1.0 - SHARE))
    half = HALF * _quantiles(np.abs(few - middle), counts, (0.5,)).max()
    reach = TIMES * (high - low)
    low = np.maximum(low - reach, middle - half) - MARGIN
    high = np.minimum(high + reach, middle + half) + MARGIN
    lowest, highest = bounds(points)
    if (lowest >= low).all() and (highest <= high).all():
        return np.ones(len(points), bool)
    return ((points >= low) & (points <= high)).all(axis=1)


def _quantiles(points, counts, shares):
    """Return (K, 3): along each axis those of points (N, 3) that count so many each."""
    if counts is None:
        return np.quantile(points, shares, axis=0)
    order = np.argsort(points, axis=0)
    share = np.cumsum(counts[order], axis=0) / counts.sum()
    rows = [np.searchsorted(share[:, axis], shares) for axis in range(3)]
    places = [points[order[row, axis], axis] for axis, row in enumerate(rows)]
    return np.array(places).T
