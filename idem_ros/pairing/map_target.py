"""A map in the place of a target message, and the parameters of it: from a file, or in parts."""

from dataclasses import dataclass

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.parameter import parameter, require_fields
from idem_ros.maps.source import MapSource
from idem_ros.messages.transform_message import sec_and_nanosec

REPLACE, ACCUMULATE = TARGET_MODES = ('replace', 'accumulate')


@dataclass(frozen=True)
class MapConfig:
    """Where the target comes from, where it is a map."""

    target_file: str = parameter(
        '',
        'a map on disk, in place of what comes on ~/target: a cloud (.pcd .ply .npy .las .laz) or '
        "a folder of tiles in Autoware's layout; empty: none",
        fixed=True,
    )
    target_frame: str = parameter('map', 'frame of the map in target_file', fixed=True)
    target_mode: str = parameter(
        REPLACE,
        'what a newer target is to the one before: "replace" it, or "accumulate": one more part '
        'of the same map, as a SLAM publishes its submaps',
        choices=TARGET_MODES,
        fixed=True,
    )
    target_radius: float = parameter(
        150.0,
        'with accumulate: what is farther from the last scan along x and y is forgotten',
        'm',
        fixed=True,
    )
    target_voxel_size: float = parameter(
        0.1,
        'with accumulate: of the points in a cube of this edge the first is kept',
        'm',
        fixed=True,
    )

    def __post_init__(self):
        require_fields(self)
        frame = self.target_frame
        if self.target_file and (not frame.strip('/') or frame != ''.join(frame.split())):
            raise InvalidConfig(
                f'target_frame is {frame!r}; it must be the name of the frame that the map in '
                'target_file is in, such as map'
            )
        if self.target_file and self.target_mode == ACCUMULATE:
            raise InvalidConfig(
                'target_mode is accumulate and target_file given: a map from a file has no parts '
                'to come; choose one'
            )


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
