"""A map in the place of a target message."""

from dataclasses import dataclass

from idem_ros.maps.source import MapSource
from idem_ros.messages.transform_message import sec_and_nanosec


@dataclass(frozen=True)
class _Stamp:
    sec: int
    nanosec: int


@dataclass(frozen=True)
class _Header:
    stamp: _Stamp
    frame_id: str


@dataclass(frozen=True, eq=False)
class MapTarget:
    """A map as a target: what pairing asks of a PointCloud2, and the points of a place.

    Args:
        header: with stamp and frame_id.
        map: `MapSource`.
    """

    header: _Header
    map: MapSource

    @classmethod
    def of(cls, map_, frame, stamp=0):
        """Return the target of a map in a frame, of a stamp [ns]."""
        return cls(_Header(_Stamp(*sec_and_nanosec(stamp)), frame), map_)
