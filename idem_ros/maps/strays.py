"""Points so far from all the rest that they are no part of a map."""

import numpy as np

from idem_ros.core.geometry.grid import bounds

SHARE = 0.01  # of the points at each end say nothing of the map's extent
TIMES, MARGIN = 10.0, 10_000.0  # of its extent, and [m] beyond it
HALF = 1000.0  # times as far from the middle as half of the points
SAMPLE = 10_000


def near_the_rest(points, counts=None):
    """Return (N,) bool: which points, or tiles of several, are not far from all the rest.

    Args:
        points: (N, 3).
        counts: (N,) how many points each stands for; None: one.
    """
    few = points[:: max(len(points) // SAMPLE, 1)] if counts is None else points
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
