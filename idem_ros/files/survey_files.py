"""Clouds of surveying: LAS and LAZ by laspy, E57 by pye57, both of the extra `survey`.

What a LAS or LAZ file declares of itself is held against its size before laspy believes it.
"""

import logging
import struct

import numpy as np

from idem_ros.files.unreadable import UnreadableCloud
from idem_ros.terminal.printable import error_line

# offsets in the public header block of LAS 1.0 to 1.4, and the least bytes of what is counted
VERSION, HEADER_SIZE, POINTS_AT, POINT_FORMAT, POINT_SIZE = 24, 94, 96, 104, 105
COUNT, EXTENDED_AT, LONG_COUNT = 107, 235, 247
LEAST_RECORD, LEAST_EXTENDED = 54, 60
LEAST_HEADER, LONG_HEADER = 227, 375
PACKED = 0x80  # in the point format: LAZ
MOST_PACKED = 200  # points that LAZ makes of a byte, at most
TABLE_HEAD = 8  # [bytes] of LAZ's table of chunks: its version, and how many there are
EXTRA = "install the extra survey: pip install 'idem_ros[survey]'"
WKT = 2112  # id of the record
GEOGRAPHIC = (1024, 2)  # key and value of GeoTIFF
MOST_CHUNK = 1 << 22  # points of LAZ; writers take 50 000
logger = logging.getLogger(__name__)


def refuse_false_las(content):
    """Refuse bytes that declare more records or points than they can hold.

    Raises:
        UnreadableCloud: says what is declared.
    """
    if content[:4] != b'LASF' or len(content) < LEAST_HEADER:
        raise UnreadableCloud('it does not begin as LAS does (LASF), or is cut off in its header')
    is_long = content[VERSION] == 1 and content[VERSION + 1] >= 4
    if is_long and len(content) < LONG_HEADER:
        raise UnreadableCloud('it is cut off in its header')
    (begin, records), size = _at('<II', content, POINTS_AT), _at('<H', content, POINT_SIZE)[0]
    (head,), (count,) = _at('<H', content, HEADER_SIZE), _at('<I', content, COUNT)
    count = _at('<Q', content, LONG_COUNT)[0] if is_long else count
    _refuse('records', records, LEAST_RECORD, len(content) - head)
    if is_long:
        start, extended = _at('<QI', content, EXTENDED_AT)
        _refuse('extended records', extended, LEAST_EXTENDED, len(content) - start)
    if not content[POINT_FORMAT] & PACKED:
        _refuse('points', count, size, len(content) - begin)
    else:
        _refuse('points', count, 1, MOST_PACKED * (len(content) - begin))
        _refuse_chunks(content, begin)


def _refuse_chunks(content, begin):
    """LAZ keeps before its points where its table of chunks is; -1: at the end."""
    if begin + 8 > len(content):
        raise UnreadableCloud(f'its points begin at byte {begin}, beyond its end')
    (table,) = _at('<q', content, begin)
    table = _at('<q', content, len(content) - 8)[0] if table == -1 else table
    if not begin + 8 <= table <= len(content) - TABLE_HEAD:
        raise UnreadableCloud('its table of chunks lies beyond its end: it is cut off or damaged')
    (chunks,) = _at('<I', content, table + 4)
    _refuse('chunks', chunks, 1, table - begin)


def _at(form, content, offset):
    return struct.unpack_from(form, content, offset)


def _refuse(what, count, least, room):
    if count and count * max(least, 1) > room:
        raise UnreadableCloud(
            f'it is cut off or damaged: it declares {count} {what}, for which '
            f'{max(room, 0)} bytes are too few'
        )


def read_las(path, columns=None):
    """Read (N, 3) points of a LAS or LAZ file, scaled and offset."""
    return np.vstack(list(las_parts(path, columns)))


def las_parts(path, columns=None, most=2**22):
    """Yield the points of a LAS or LAZ file `most` at a time."""
    try:
        import laspy
    except ImportError as error:
        raise UnreadableCloud(f'laspy is not installed; {EXTRA}') from error
    _refuse_columns(columns)
    refuse_false_las(path.read_bytes())
    try:
        with laspy.open(path) as las:
            if las.header.point_count == 0:
                raise UnreadableCloud('it says itself that it holds 0 points')
            if las.header.are_points_compressed:
                _refuse_false_chunks(path, las.header)
            _refuse_degrees(las.header.vlrs)
            for part in las.chunk_iterator(most):
                yield np.stack([np.asarray(axis) for axis in (part.x, part.y, part.z)], axis=1)
    except laspy.LaspyException as error:
        raise UnreadableCloud(f'it is cut off, damaged or no LAS: {_line(error)}') from error


def _refuse_degrees(records):
    """Refuse longitudes and latitudes, as the records of a LAS say what its coordinates are."""
    for record in records:
        keys = [(key.id, key.value_offset) for key in getattr(record, 'geo_keys', ())]
        wkt = getattr(record, 'string', '') if record.record_id == WKT else ''
        has_angles = any(word in wkt for word in ('GEOGCS', 'GEOGCRS')) and 'PROJ' not in wkt
        if GEOGRAPHIC in keys or (has_angles and 'GEOCCS' not in wkt):
            raise UnreadableCloud(
                'its coordinates are longitude and latitude; they must be projected, as to UTM'
            )


def _refuse_false_chunks(path, header):
    """Refuse chunks larger than any writer makes, or than the file: they would be allocated."""
    from lazrs.lazrs import LazVlr, read_chunk_table  # pyright: ignore[reportMissingModuleSource]

    most = max(MOST_CHUNK, header.point_count), path.stat().st_size
    with path.open('rb') as stream:
        stream.seek(header.offset_to_point_data)
        packing = LazVlr(header.vlrs.get('LasZipVlr')[0].record_data)
        for points, packed in read_chunk_table(stream, packing):
            if points > most[0] or packed > most[1]:
                raise UnreadableCloud(
                    f'it is damaged: a chunk is said to hold {points} points in {packed} bytes'
                )


def read_e57(path, columns=None):
    """Read (N, 3) points of an E57 file: of all its scans, each in its pose."""
    try:
        import pye57
    except ImportError as error:
        raise UnreadableCloud(f'pye57 is not installed; {EXTRA}') from error
    _refuse_columns(columns)
    try:
        file = pye57.E57(str(path))
    except pye57.libe57.E57Exception as error:
        raise UnreadableCloud(f'it is cut off, damaged or no E57: {_cause(error)}') from error
    try:
        return _put_together(file, path)
    except pye57.libe57.E57Exception as error:
        raise UnreadableCloud(f'it is damaged: {_cause(error)}') from error
    finally:
        file.close()


def _put_together(file, path):
    count = file.scan_count
    declared = sum(file.get_header(i).point_count for i in range(count))
    if not 0 < declared <= MOST_PACKED * path.stat().st_size:
        raise UnreadableCloud(f'it declares {count} scans of {declared} points: empty or damaged')
    if count > 1:
        logger.warning('%s: its %d scans are put together, each in its pose', path, count)
    scans = (file.read_scan(i, ignore_missing_fields=True) for i in range(count))
    return np.vstack(
        [np.stack([scan[f'cartesian{axis}'] for axis in 'XYZ'], axis=1) for scan in scans]
    )


def _refuse_columns(columns):
    if columns is not None:
        raise UnreadableCloud('--columns is for tables and .bin; this format names x, y and z')


def _line(error):
    return error_line(error)[:200]


def _cause(error):
    """Return what libE57Format says before its debug information."""
    text = _line(error).partition('Debug info')[0]
    return text.partition('exception:')[2].strip() or text.strip() or 'no word why'
