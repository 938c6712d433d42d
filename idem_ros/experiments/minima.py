"""Where a metric is least on a grid of translations: of all of it, or downhill from its middle."""

from itertools import product

import numpy as np

from idem_ros.experiments.distances import STEEPEST, Distances
from idem_ros.experiments.maps import Map, unit_of

COARSEST = 27  # steps between the first places; a power of three
NINE = np.array(list(product((0, -1, 1), repeat=2)))  # the middle first: it wins a draw
ROUNDED = 1e-9  # [the clouds' unit]: by how much equal values may differ


def least_distances(case, distances, axes, offsets):
    """Return a `Map` of each of `Distances` that is exact wherever it may be least.

    Branch and bound: no distance falls faster than `STEEPEST`, so that a place rules out all
    about it that cannot come below what is known. `Map.minimum` is that of the whole grid;
    where nothing was looked at, the map holds the greatest value that was found.

    Args:
        case: `Case` that names the clouds.
        distances: `CloudDistances` of the same.
        axes: two names of translations.
        offsets: (n,) evenly spaced along both axes [the case's unit].
    """
    found = _searched(distances, axes, offsets)
    found = np.where(np.isnan(found), np.nanmax(found, axis=(1, 2))[:, None, None], found)
    label, unit = f'distance [{case.unit}]', unit_of(case, axes)
    return Distances(
        *(Map(case.name, label, axes, (offsets, offsets), values, unit) for values in found)
    )


def nearest_minima(distances, axes, offsets):
    """Return how far from the middle of the grid a descent from there ends, for `Distances`.

    Each step goes to the least of the eight neighbours, while it is lower.
    """
    known: dict = {}  # {place: (4,) values}, for the ways down begin alike
    return Distances(
        *(_descended(distances, number, axes, offsets, known) for number in range(len(STEEPEST)))
    )


def _searched(distances, axes, offsets):
    """Return (4, n, n) values; nan where no distance can be least."""
    last, stride = len(offsets) - 1, COARSEST
    found = np.full((len(STEEPEST), len(offsets), len(offsets)), np.nan)
    firsts = range(stride // 2, last + stride, stride)
    cells = np.array(list(product(firsts, firsts)))  # middles; each reaches stride // 2
    while True:
        # A middle beyond the edge stands for its cell from the edge: that is only nearer.
        at = tuple(np.clip(cells, 0, last).T)
        places = np.unique(np.stack(at, axis=1), axis=0)
        places = places[np.isnan(found[0][tuple(places.T)])]
        if len(places):
            found[(slice(None), *places.T)] = distances.at(_shifts(axes, offsets, places))
        if stride == 1:
            return found
        cells = cells[_may_hold_least(found, at, stride // 2 * (offsets[1] - offsets[0]))]
        stride //= 3
        cells = (cells[:, None] + stride * NINE).reshape(-1, 2)
        inside = (cells + stride // 2 >= 0) & (cells - stride // 2 <= last)
        cells = cells[inside.all(axis=1)]


def _may_hold_least(found, at, reach):
    """Return (K,) whether a value within `reach` of a place along both axes may be least."""
    fall = np.sqrt(2.0) * reach * np.array(STEEPEST)[:, None]
    least = np.nanmin(found, axis=(1, 2))[:, None]
    return (found[(slice(None), *at)] - fall <= least + ROUNDED).any(axis=0)


def _descended(distances, number, axes, offsets, known):
    last = len(offsets) - 1
    place, least = np.full(2, last // 2), np.inf
    while True:
        around = place + NINE
        around = around[((around >= 0) & (around <= last)).all(axis=1)]
        new = [each for each in map(tuple, around.tolist()) if each not in known]
        if new:
            found = distances.at(_shifts(axes, offsets, np.array(new)))
            known.update(zip(new, np.transpose(found), strict=True))
        values = np.array([known[tuple(each)][number] for each in around.tolist()])
        if values.min() >= least - ROUNDED:
            return float(np.hypot(*offsets[place]))
        place, least = around[np.argmin(values)], values.min()


def _shifts(axes, offsets, places):
    """Return the (K, 3) translations at (K, 2) places of the grid."""
    shifts = np.zeros((len(places), 3))
    shifts[:, ['xyz'.index(axis) for axis in axes]] = offsets[places]
    return shifts
