"""Clouds as NumPy saves arrays."""

import math

import numpy as np
from numpy.lib import format as npy

from idem_ros.files.columns import points_of_records
from idem_ros.files.nameless import (
    LOOKED_AT,
    are_columns,
    note_first_three,
    refuse_no_coordinates,
)
from idem_ros.files.unreadable import UnreadableCloud

LONGEST = 1 << 16  # [bytes] of header
SAMPLE = 200  # rows


def read_npy(path, columns=None):
    """Read (N, 3) points of an array of rows, or of one with fields x, y, z in any shape."""
    with path.open('rb') as stream:
        check_npy(stream, path.stat().st_size)
        return first_points_of(np.load(stream, allow_pickle=False), columns, path)


def npy_parts(path, columns=None, most=None):
    """Yield the points of an array in rows `most` at a time; of another all at once."""
    with path.open('rb') as stream:
        shape, is_fortran, dtype = check_npy(stream, path.stat().st_size)
        if is_fortran or len(shape) not in (1, 2) or most is None:
            yield first_points_of(np.load(stream, allow_pickle=False), columns, path)
            return
        _read_header(stream)
        per_row = math.prod(shape[1:])
        for begin in range(0, shape[0], most):
            rows = min(most, shape[0] - begin)
            array = np.fromfile(stream, dtype, rows * per_row).reshape(rows, *shape[1:])
            yield _points_of(array, columns) if begin else first_points_of(array, columns, path)


def first_points_of(array, columns, path):
    """Return (N, 3) points of an array, or of its begin: what its columns are is doubted once.

    Args:
        array: of rows, or with fields x, y, z.
        columns: see `read_cloud`.
        path: what messages name.

    Raises:
        UnreadableCloud: it holds none, or does not say which they are.
    """
    points = _points_of(array, columns)
    if columns is None and not array.dtype.names and array.shape[1] > 3:
        rows = array[:SAMPLE, :LOOKED_AT].astype(np.float64)
        refuse_no_coordinates(array[:, 0].astype(np.float64), rows)
        note_first_three(path, array.shape[1])
    return points


def _points_of(array, columns):
    if array.dtype.names:
        return points_of_records(array, columns)
    points_in_rows = array.ndim == 2 and array.shape[1] >= 3 and not are_columns(*array.shape)
    if not points_in_rows or array.dtype.kind not in 'fiu':
        raise UnreadableCloud(
            f'it has shape {str(array.shape)[:80]} and dtype {array.dtype}; it must be (N, 3), of '
            'numbers, a point a row'
        )
    chosen = (1, 2, 3) if columns is None else columns
    if isinstance(chosen, int) or not all(isinstance(c, int) for c in chosen):
        raise UnreadableCloud('its columns have no names; --columns takes three numbers')
    if not all(1 <= c <= array.shape[1] for c in chosen):
        raise UnreadableCloud(f'it has columns 1 to {array.shape[1]}; --columns is {chosen}')
    return array[:, [c - 1 for c in chosen]]


def _read_header(stream):
    """Return (shape, whether in Fortran's order, dtype); what follows is the array's bytes."""
    version = npy.read_magic(stream)
    header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    return header(stream)


def npy_names(path, columns=None):
    """Return the names of the fields of an array; [] of one without."""
    array = np.load(path, mmap_mode='r', allow_pickle=False)
    return list(array.dtype.names or ())


def check_npy(stream, size):
    """Refuse an array that is declared larger than its file; return its `_read_header`."""
    try:
        version = npy.read_magic(stream)
    except ValueError as error:
        raise UnreadableCloud('it does not begin as an array of NumPy does (np.save)') from error
    if version not in ((1, 0), (2, 0), (3, 0)):
        raise UnreadableCloud(f'its format has version {version[0]}.{version[1]}, unknown here')
    width = 2 if version == (1, 0) else 4
    if int.from_bytes(stream.read(width), 'little') > min(size, LONGEST):
        raise UnreadableCloud('its header is longer than the file, or than any of points')
    stream.seek(0)
    shape, is_fortran, dtype = _read_header(stream)
    if dtype.hasobject:
        raise UnreadableCloud('it holds Python objects, which are not opened')
    wanted = math.prod(shape) * dtype.itemsize
    if wanted > size - stream.tell():
        raise UnreadableCloud(
            f'it is cut off: shape {str(shape)[:80]} of {dtype.itemsize} bytes each is more than '
            f'the {size - stream.tell()} bytes that follow its header'
        )
    if min(shape, default=1) < 0 or (dtype.itemsize == 0 and math.prod(shape)):
        raise UnreadableCloud(f'its shape {str(shape)[:80]} is none of points')
    stream.seek(0)
    return shape, is_fortran, dtype
