"""Clouds of surveying: LAS and LAZ by laspy, E57 by pye57, both of the extra `survey`."""

import logging

import numpy as np

from idem_ros.files.las_header import MOST_PACKED, refuse_false_las
from idem_ros.files.unreadable import UnreadableCloud
from idem_ros.terminal.printable import error_line

EXTRA = "install the extra survey: pip install 'idem_ros[survey]'"
WKT = 2112  # id of the record
GEOGRAPHIC = (1024, 2)  # key and value of GeoTIFF
MOST_CHUNK = 1 << 22  # points of LAZ; writers take 50 000

logger = logging.getLogger(__name__)


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
