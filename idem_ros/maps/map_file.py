"""A map of one file, read once."""

import logging

import numpy as np

from idem_ros.files.cloud_file import cloud_parts
from idem_ros.maps.plausible import require_metres
from idem_ros.maps.sorted_points import SortedPoints
from idem_ros.maps.strays import near_the_rest

logger = logging.getLogger(__name__)


class MapPoints:
    """A map that is held in memory; points far from all the rest are left out, and named.

    Args:
        points: (N, 3) finite, N >= 1, in the map's frame [m].
        name: what messages call it.

    Attributes:
        name, bounds: see `MapSource`.
    """

    def __init__(self, points, name):
        self.name = name
        self._points = SortedPoints(_without_strays(points, name))
        self.bounds = self._points.bounds

    def __len__(self):
        return len(self._points)

    def points_within(self, low, high):
        """Return the (N, 3) points with low <= p < high."""
        return self._points.within(np.asarray(low), np.asarray(high))

    def keep_near(self, center, reach):
        """Keep all of it: it is read once."""

    def densest(self):
        """Return the points of the column that holds most."""
        return self._points.densest()


def _without_strays(points, name):
    near = near_the_rest(points)
    if near.all():
        return points
    logger.warning('%s: %d points far from all the rest are left out', name, (~near).sum())
    return points[near]


def read_map_file(path, columns=None):
    """Read a map of one file, of any format that `read_cloud` takes.

    Raises:
        UnreadableCloud: it cannot be read.
        UnusableMap: its points stand too far apart to be in metres.
    """
    points = MapPoints(np.concatenate(list(cloud_parts(path, columns))), str(path))
    require_metres(points.densest(), points.name)
    return points
