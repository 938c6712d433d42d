"""A map that comes in parts: put together when it is asked for, and never changed then."""

import threading
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

EDGE = 32.0  # [m] of a column


class Near:
    """Where scans were last, for all that a map grows into.

    Attributes:
        center: (3,) in the map's frame; None: nowhere yet.
    """

    center: NDArray[np.float64] | None = None


class AccumulatedMap:
    """The points of a part and of those before it; of each voxel the first, and near scans only.

    Args:
        read: gives the (N, 3) points of the part, when they are asked for.
        before: `AccumulatedMap` that it is a part of; None: it is the first.
        radius: what is farther from the last scan along x and y is left out [m].
        voxel_size: edge of the cubes that one point of is kept [m].
    """

    name = 'map of parts'

    def __init__(self, read, before, radius, voxel_size):
        self._read: Any = read
        self._before = before
        self._radius, self._voxel_size = radius, voxel_size
        self._near = Near() if before is None else before._near
        self._kept: tuple[dict, NDArray] | None = None  # {column: points} and their bounds
        self._lock = threading.Lock()

    @property
    def bounds(self):
        """The lowest and highest coordinates (2, 3)."""
        return self._put_together()[1]

    def __len__(self):
        return sum(map(len, self._put_together()[0].values()))

    def points_within(self, low, high):
        """Return the (N, 3) points with low <= p < high."""
        kept, _ = self._put_together()
        first, last = (np.floor(np.asarray(c)[:2] / EDGE).astype(int) for c in (low, high))
        wanted = np.prod((last - first + 1).astype(float))
        places = (
            product(*(range(a, b + 1) for a, b in zip(first, last, strict=True)))
            if wanted < len(kept)
            else [c for c in kept if (c >= first).all() and (c <= last).all()]
        )
        columns = [kept[place] for place in places if place in kept]
        inside = [p[((p >= low) & (p < high)).all(axis=1)] for p in columns]
        return np.concatenate([np.empty((0, 3)), *inside])

    def keep_near(self, center, reach):
        """Note where scans are: what is far from there is no part of the map's next state."""
        self._near.center = np.asarray(center, dtype=np.float64)

    def _put_together(self):
        with self._lock:
            if self._kept is not None:
                return self._kept
            parts, before = [self._read], self._before
            while before is not None and before._kept is None:
                parts.append(before._read)
                before = before._before
            known = None if before is None else before._kept
            columns = {} if known is None else self._near_the_last(known[0])
            for read in reversed(parts):
                columns = _grown(columns, read(), self._voxel_size)
            everything = [c for p in columns.values() for c in (p.min(axis=0), p.max(axis=0))]
            low, high = np.min(everything, axis=0), np.max(everything, axis=0)
            self._kept = columns, np.array([low, high])
            self._read = self._before = None
            return self._kept

    def _near_the_last(self, columns):
        center = self._near.center
        if center is None:
            return columns
        middles = {place: (np.array(place) + 0.5) * EDGE for place in columns}
        reach = self._radius + EDGE
        return {
            place: columns[place]
            for place, middle in middles.items()
            if (np.abs(middle - center[:2]) <= reach).all()
        }


def _grown(columns, points, voxel_size):
    """Return {column: points}, of each voxel the first point; those given stay as they are."""
    place = np.floor(points[:, :2] / EDGE).astype(np.int64)
    order = np.lexsort(place.T)
    changes = np.flatnonzero((np.diff(place[order], axis=0) != 0).any(axis=1)) + 1
    grown = dict(columns)
    for rows in np.split(order, changes):
        here = tuple(place[rows[0]].tolist())
        joined = np.concatenate([columns.get(here, np.empty((0, 3))), points[np.sort(rows)]])
        grown[here] = joined[_first_of_each(np.floor(joined / voxel_size).astype(np.int64))]
    return grown


def _first_of_each(voxels):
    """Return the rows, rising, that are the first of their voxel."""
    corner = voxels - voxels.min(axis=0)
    span = corner.max(axis=0) + 1
    key = (corner[:, 0] * span[1] + corner[:, 1]) * span[2] + corner[:, 2]
    return np.sort(np.unique(key, return_index=True)[1])
