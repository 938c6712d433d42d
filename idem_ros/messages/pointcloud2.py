"""PointCloud2-like messages to points and back, whoever deserialised them; imports no ROS."""

from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.exceptions import InvalidCloud
from idem_ros.messages.point_times import (
    NoTimes,
    TimesRead,
    azimuth_times,
    first_times,
    time_fields,
    times_of,
)
from idem_ros.messages.transform_message import stamp_ns

FLOAT32, FLOAT64 = 7, 8
COORDINATE_TYPES = {FLOAT32: 'f4', FLOAT64: 'f8'}
TYPES = dict(enumerate(('i1', 'u1', 'i2', 'u2', 'i4', 'u4', 'f4', 'f8'), start=1))
BLOCK = 1024  # points looked at in one go


class InvalidPointCloud2(InvalidCloud):
    """A PointCloud2 message that contradicts itself or holds no usable point."""


@dataclass(frozen=True)
class PointsRead:
    """The usable points of a message and how many of its points were not."""

    points: NDArray[np.float64]
    """(N, 3), in the frame and unit of the message."""
    dropped_nonfinite: int
    """Points with a coordinate that is NaN or infinite."""
    dropped_zero: int
    """Points at exactly (0, 0, 0): how drivers fill what they did not measure."""
    times: TimesRead = TimesRead(None, '')
    """When each of the points was measured."""
    dropped_stray: int = 0
    """Points far from all the rest, see `near_the_rest`."""


@dataclass(frozen=True)
class PackedCloud:
    """The fields of a sensor_msgs/PointCloud2 but its header, as every writer needs them."""

    height: int
    width: int
    fields: tuple[tuple[str, int, int, int], ...]
    """(name, offset, datatype, count) of each."""
    is_bigendian: bool
    point_step: int
    row_step: int
    data: NDArray[np.uint8]
    is_dense: bool

    @property
    def layout(self):
        """All but `fields` and `data`, {field: value}: no writer makes something else of these."""
        names = ('height', 'width', 'is_bigendian', 'point_step', 'row_step', 'is_dense')
        return {name: getattr(self, name) for name in names}


def read_points(message, times=None):
    """Read x, y, z of a PointCloud2; the message itself is left untouched.

    Any order of fields, padding of points and rows, organised clouds, float32 and float64 and both
    byte orders are read. Points that are not finite, exactly zero or far from all the rest are
    dropped and counted, whatever `is_dense` claims.

    Args:
        message: an object with the fields of sensor_msgs/PointCloud2 (of rclpy, rosbags, ...).
        times: `PointTimeConfig`, where the times of points come from; None: they are not read.

    Returns:
        `PointsRead`, with at least one point. Times that cannot be used are no error: it is said
        why there are none.

    Raises:
        InvalidPointCloud2: its fields, sizes and data contradict each other, or none is usable.
    """
    from idem_ros.core.metric.measured_points import near_the_rest  # numba: `--help` has no use

    layout = _layout(message)
    points = _stacked(_columns(message, layout))
    usable, finite = _usable(points)
    dropped_nonfinite = int(len(points) - finite.sum())
    dropped_zero = int(len(points) - usable.sum()) - dropped_nonfinite
    if not usable.any():
        raise InvalidPointCloud2(
            f'none of its {len(points)} points is usable: {dropped_nonfinite} not finite, '
            f'{dropped_zero} exactly zero'
        )
    kept = points if usable.all() else points[usable]
    near = near_the_rest(kept)
    if not near.all():
        usable[usable], kept = near, kept[near]
    read = TimesRead(None, '') if times is None else _times(message, layout, usable, kept, times)
    strays = int(len(near) - len(kept))
    return PointsRead(kept, dropped_nonfinite, dropped_zero, read, strays)


def require_points(message, least):
    """Refuse a PointCloud2 that `read_points` would, or of fewer usable points, without a copy.

    It looks no farther into the points than to the least number of usable ones.

    Raises:
        InvalidPointCloud2: it says what is wrong with it.
    """
    columns = _columns(message, _layout(message))
    rows, per_row = columns[0].shape
    step = max(BLOCK // per_row, 1)
    found = 0
    for begin in range(0, rows, step):
        block = _stacked([column[begin : begin + step] for column in columns])
        found += int(_usable(block)[0].sum())
        if found >= least:
            return
    raise InvalidPointCloud2(
        f'of its {rows * per_row} points {found} are usable (finite, and not exactly zero); '
        f'{least} are needed'
    )


class _Layout(NamedTuple):
    """Where the points of a message are: each field is a view (rows, points per row)."""

    data: NDArray[np.uint8]
    order: str
    shape: tuple[int, int]
    strides: tuple[int, int]

    def view(self, offset, dtype):
        return np.ndarray(self.shape, self.order + dtype, self.data, offset, self.strides)


def _layout(message):
    try:
        data = np.frombuffer(message.data, dtype=np.uint8)
    except (TypeError, ValueError, BufferError) as error:
        raise InvalidPointCloud2(f'its data is not a buffer of bytes: {error}') from error
    height, width, row_step = _checked_size(message, data.size)
    step = int(message.point_step)
    shape, strides = (height, width), (row_step, step)
    if height == 1 or row_step == width * step:
        shape, strides = (height * width, 1), (step, step)
    return _Layout(data, '>' if message.is_bigendian else '<', shape, strides)


def _columns(message, layout):
    """Return x, y and z as views into the message, each (rows, points per row)."""
    # three separate fields fit into a point, so the data bounds the number of points
    return [layout.view(offset, dtype) for offset, dtype in _coordinates(message)]


def _times(message, layout, usable, points, config):
    """Return the `TimesRead` of the usable points."""
    stamp = stamp_ns(message)
    if config.origin == 'azimuth':
        return first_times([lambda: azimuth_times(points, config)], 'azimuth')
    if config.origin == 'none':
        return TimesRead(None, '')
    fields = [
        message.fields[i] for i in time_fields([f.name for f in message.fields], config.field)
    ]

    def times_in(field):
        dtype = TYPES.get(field.datatype)
        end = field.offset + (int(dtype[1]) if dtype else 0)
        if dtype is None or field.count > 1 or field.offset < 0 or end > message.point_step:
            raise NoTimes(f'field {field.name} is not one number of each point')
        values = layout.view(field.offset, dtype).reshape(-1)[usable]
        return times_of(values, field.name, points, stamp, config)

    return first_times([partial(times_in, field) for field in fields], config.field)


def _stacked(columns):
    """Copy three views (rows, points per row) as (N, 3) points."""
    points = np.empty((columns[0].size, 3))
    with np.errstate(invalid='ignore'):  # signalling NaNs are dropped later
        for axis, column in enumerate(columns):
            points[:, axis] = column.reshape(-1)
    return points


def pack_points(points, dtype=np.float32, columns=None):
    """Pack points as the x, y, z of an unorganised little-endian cloud without padding.

    Args:
        points: (N, 3), finite.
        dtype: np.float32 or np.float64, of every field.
        columns: {name: (N,) numbers} of more fields after z, such as an intensity.

    Returns:
        `PackedCloud` of N points.
    """
    dtype = np.dtype(dtype).newbyteorder('<')
    datatype = FLOAT32 if dtype.itemsize == 4 else FLOAT64
    names = [*'xyz', *(columns or {})]
    if columns:
        points = np.column_stack([points, *columns.values()])
    packed = np.ascontiguousarray(points, dtype=dtype)
    step = len(names) * dtype.itemsize
    return PackedCloud(
        height=1,
        width=len(packed),
        fields=tuple((name, i * dtype.itemsize, datatype, 1) for i, name in enumerate(names)),
        is_bigendian=False,
        point_step=step,
        row_step=step * len(packed),
        data=packed.reshape(-1).view(np.uint8),
        is_dense=True,
    )


def _checked_size(message, size):
    height, width, step = int(message.height), int(message.width), int(message.point_step)
    row_step = int(message.row_step) or width * step  # 0 is how some drivers say "no padding"
    if min(height, width, step, row_step) < 0:
        raise InvalidPointCloud2(
            f'a size is negative: height {height}, width {width}, point_step {step}, '
            f'row_step {row_step}'
        )
    if height * width == 0:
        raise InvalidPointCloud2(f'it holds no points: height {height}, width {width}')
    if row_step < width * step:
        raise InvalidPointCloud2(
            f'row_step {row_step} is too small for {width} points of {step} bytes; '
            f'it must be {width * step} or more'
        )
    if size != height * row_step:
        raise InvalidPointCloud2(
            f'its data holds {size} bytes, but height {height} x row_step {row_step} '
            f'asks for {height * row_step}'
        )
    return height, width, row_step


def _coordinates(message):
    """Return (offset, numpy type) of x, y and z."""
    found = []
    for name in 'xyz':
        fields = [field for field in message.fields if field.name == name]
        if len(fields) != 1:
            names = ', '.join(str(field.name) for field in message.fields) or 'none'
            how = 'no field' if not fields else f'{len(fields)} fields'
            raise InvalidPointCloud2(f'it has {how} {name!r}; its fields: {names}')
        found.append(_checked_field(fields[0], message.point_step))
    spans = sorted((offset, offset + int(dtype[1])) for offset, dtype in found)
    if any(end > start for (_, end), (start, _) in pairwise(spans)):
        raise InvalidPointCloud2(
            f'its fields x, y, z overlap: offsets {[offset for offset, _ in found]}'
        )
    return found


def _checked_field(field, point_step):
    if field.datatype not in COORDINATE_TYPES:
        raise InvalidPointCloud2(
            f'field {field.name!r} has datatype {field.datatype}; '
            f'it must be {FLOAT32} (FLOAT32) or {FLOAT64} (FLOAT64)'
        )
    if field.count > 1:
        raise InvalidPointCloud2(f'field {field.name!r} has count {field.count}; it must be 1')
    dtype = COORDINATE_TYPES[field.datatype]
    if field.offset < 0 or field.offset + int(dtype[1]) > point_step:
        raise InvalidPointCloud2(
            f'field {field.name!r} at offset {field.offset} reaches beyond point_step {point_step}'
        )
    return field.offset, dtype


def _usable(points):
    """Return (N,) bool: which points are usable, and which are finite."""
    x, y, z = points.T  # a column at a time: numpy reduces rows of three ten times slower
    finite = np.isfinite(x) & np.isfinite(y) & np.isfinite(z)
    zero = x == 0.0
    if zero.any():
        zero &= (y == 0.0) & (z == 0.0)
    return finite & ~zero, finite
