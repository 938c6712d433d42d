"""Clouds of surveying: LAS and LAZ by laspy, E57 by pye57, both of the extra `survey`."""

import logging

import numpy as np

from idem_ros.files.unreadable import UnreadableCloud

MOST_PACKED = 200  # points that LAZ makes of a byte, at most
EXTRA = "install the extra survey: pip install 'idem_ros[survey]'"

logger = logging.getLogger(__name__)


def read_las(path, columns=None):
    """Read (N, 3) points of a LAS or LAZ file, scaled and offset."""
    try:
        import laspy
    except ImportError as error:
        raise UnreadableCloud(f'laspy is not installed; {EXTRA}') from error
    _refuse_columns(columns)
    content_size = path.stat().st_size
    try:
        with laspy.open(path) as reader:
            header = reader.header
            declared = header.point_count * header.point_format.size
            room = content_size - header.offset_to_point_data
            most = (
                MOST_PACKED * content_size * header.point_format.size
                if header.are_points_compressed
                else room
            )
            if declared > most:
                raise UnreadableCloud(
                    f'it is cut off: its header declares {header.point_count} points, for which '
                    f'{room} bytes are too few'
                )
            las = reader.read()
            return np.stack([np.asarray(las.x), np.asarray(las.y), np.asarray(las.z)], axis=1)
    except laspy.LaspyException as error:
        raise UnreadableCloud(f'it is cut off, damaged or no LAS: {_line(error)}') from error


def read_e57(path, columns=None):
    """Read (N, 3) points of an E57 file: of all its scans, each in its pose."""
    try:
        import pye57
    except ImportError as error:
        raise UnreadableCloud(f'pye57 is not installed; {EXTRA}') from error
    _refuse_columns(columns)
    file = pye57.E57(str(path))
    try:
        count = file.scan_count
        if count == 0:
            raise UnreadableCloud('it holds no scan')
        if count > 1:
            logger.warning('%s: its %d scans are put together, each in its pose', path, count)
        scans = (file.read_scan(i, ignore_missing_fields=True) for i in range(count))
        return np.vstack(
            [np.stack([scan[f'cartesian{axis}'] for axis in 'XYZ'], axis=1) for scan in scans]
        )
    finally:
        file.close()


def _refuse_columns(columns):
    if columns is not None:
        raise UnreadableCloud('--columns is for tables and .bin; this format names x, y and z')


def _line(error):
    return ' '.join(str(error).split())[:200]
