"""Points so far from all the rest that they are no part of a map."""

import numpy as np

from idem_ros.core.geometry.grid import bounds

SHARE = 0.01  # of the points at each end say nothing of the map's extent
TIMES, MARGIN = 10.0, 10_000.0  # of its extent, and [m] beyond it


def near_the_rest(points, counts=None):
    """Return (N,) bool: which points, or tiles of several, are not far from all the rest.

    Those are left out, and then those that are far from all the rest of what is left.

    Args:
        points: (N, 3).
        counts: (N,) how many points each stands for; None: one.
    """
    near = _once(points, counts)
    while not near.all():
        kept = _once(points[near], None if counts is None else counts[near])
        if kept.all():
            break
        near[near] = kept
    return near


def _once(points, counts):
    low, high = np.empty((2, 3))
    for axis, values in enumerate(points.T):
        low[axis], high[axis] = _quantiles(values, counts)
    reach = TIMES * (high - low) + MARGIN
    lowest, highest = bounds(points)
    if (lowest >= low - reach).all() and (highest <= high + reach).all():
        return np.ones(len(points), bool)
    return ((points >= low - reach) & (points <= high + reach)).all(axis=1)


def _quantiles(values, counts):
    if counts is None:
        sample = values[:: max(len(values) // 10_000, 1)]
        return np.quantile(sample, (SHARE, 1.0 - SHARE))
    order = np.argsort(values)
    share = np.cumsum(counts[order]) / counts.sum()
    return values[order[np.searchsorted(share, (SHARE, 1.0 - SHARE))]]
