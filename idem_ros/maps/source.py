"""What a map on disk, in tiles or in parts has in common: it gives the points of a box."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.exceptions import IdemError


class UnusableMap(IdemError):
    """A map that cannot be read, or that no scan in metres can be found in."""


class MapSource(Protocol):
    """The points of a map, place by place; asked from several threads.

    Attributes:
        name: what messages call it.
    """

    name: str

    @property
    def bounds(self) -> NDArray[np.float64]:
        """The lowest and highest coordinates (2, 3) that a point may have, in the map's frame."""
        ...

    def points_within(self, low, high) -> NDArray[np.float64]:
        """Return the (N, 3) points with low <= p < high; of the same box always the same."""
        ...

    def keep_near(self, center, reach) -> None:
        """Let go of what need not be kept in memory while scans are near a place.

        Args:
            center: (3,) in the map's frame.
            reach: of scans, along x and y [m].
        """
        ...
