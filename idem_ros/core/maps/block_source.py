"""Where a map's points come from: a box at a time."""

from typing import Protocol

from idem_ros.core.arrays import Floats, Point, Points


class BlockSource(Protocol):
    """A map's points by where they are: tiles on disk, an array in memory, a formula.

    A `MapCloud` asks for cubes, keeps what it makes of them, and asks again for what it has let go
    of; from two threads at once, where it prepares ahead.
    """

    @property
    def bounds(self) -> Floats:
        """The lowest and highest coordinates, (2, 3), of all points or farther out."""
        ...

    def points_within(self, low: Point, high: Point, /) -> Points:
        """Return all points (N, 3), float64 and finite, with low <= p < high along each axis.

        In an order that is always the same; none, (0, 3), where there is nothing. What lies
        elsewhere should cost nothing.
        """
        ...
