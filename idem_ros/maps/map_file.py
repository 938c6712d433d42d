"""A map of one file, read once."""

import logging

import numpy as np

from idem_ros.core.maps.point_blocks import PointBlocks
from idem_ros.files.cloud_file import cloud_parts
from idem_ros.maps.plausible import require_metres
from idem_ros.maps.strays import near_the_rest

logger = logging.getLogger(__name__)


class MapPoints(PointBlocks):
    """A map that is held in memory.

    Args:
        points: (N, 3) finite, N >= 1, in the map's frame [m].
        name: what messages call it.
    """

    def __init__(self, points, name):
        super().__init__(points)
        self.name = name

    def keep_near(self, center, reach):
        """Keep all of it: it is read once."""


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
    name = str(path)
    points = _without_strays(np.concatenate(list(cloud_parts(path, columns))), name)
    read = MapPoints(points, name)
    require_metres(points, read.points_within, name)
    return read
