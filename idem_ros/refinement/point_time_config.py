"""How the time of each point is found: the parameters of what `point_times` infers otherwise."""

from dataclasses import dataclass

from idem_ros.core.parameter import parameter, require_fields
from idem_ros.messages.point_times import AUTO, NANOSECONDS, STAMP_AT

SOURCES = ('field', 'azimuth', 'none')
UNITS = (AUTO, *NANOSECONDS)
PLACES = (AUTO, *STAMP_AT)


@dataclass(frozen=True)
class PointTimeConfig:
    """Where the times of points come from; by default their values say unit and reference."""

    origin: str = parameter(
        'field',
        'where the time of each point comes from: "field" (of the cloud), "azimuth" (points in '
        'the order of their azimuths, of a LiDAR that turns about its z axis and gives no times) '
        'or "none"',
        name='point_time.from',
        choices=SOURCES,
    )
    field: str = parameter(
        '',
        'field that holds the times; empty: the first of t, time, timestamp, offset_time, '
        'time_stamp, t_us, stamps, time_offset, time_offset_ns, point_time_offset that can be '
        'used. Of an array without names: the number of its column, from 1',
        name='point_time.field',
    )
    unit: str = parameter(
        AUTO,
        'unit of the field; "auto": the one that drivers mean by its name where a sweep then '
        'lasts 8 ms to a minute, else the one in which it lasts 8 ms to a second',
        name='point_time.unit',
        choices=UNITS,
    )
    stamp_at: str = parameter(
        AUTO,
        'which instant of a sweep the stamp of its cloud is, whatever the field counts from; '
        '"auto": as the field says, and by azimuth "begin"',
        name='point_time.stamp_at',
        choices=PLACES,
    )
    turn: float = parameter(
        0.1, 'by azimuth: what a turn of the sensor lasts', 's', name='point_time.turn'
    )

    def __post_init__(self):
        require_fields(self)
