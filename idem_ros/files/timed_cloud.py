"""Clouds of files with the times of their points, where a column holds them."""

import logging

import numpy as np

from idem_ros.core.metric.measured_points import near_the_rest
from idem_ros.files.cloud_file import READERS, errors_of, read_cloud, reader_of, usable_points
from idem_ros.files.npy_file import npy_names
from idem_ros.files.pcd_file import pcd_names
from idem_ros.files.ply_file import ply_names
from idem_ros.files.text_table import read_text, text_names
from idem_ros.files.unreadable import UnreadableCloud
from idem_ros.messages.point_times import (
    NO_FIELD,
    azimuth_times,
    first_times,
    time_fields,
    times_of,
)

NAMES = {'.npy': npy_names, '.pcd': pcd_names, '.ply': ply_names}
NAMES |= {suffix: text_names for suffix, reader in READERS.items() if reader is read_text}

logger = logging.getLogger(__name__)


def read_timed_cloud(path, columns=None, point_times=None, stamp=0):
    """Read the usable points of a cloud file and their times.

    Of .pcd, .ply, .npy and tables; other formats have none. Times that cannot be used are no
    error: a warning says why.

    Args:
        path, columns: see `read_cloud`.
        point_times: `PointTimeConfig`; of columns without names its `field` is a number, from 1.
        stamp: of the cloud [ns]; 0: it has none, and absolute times count from the first.

    Returns:
        (N, 3) points, and (N,) times in seconds after the stamp, or None.

    Raises:
        UnreadableCloud: see `read_cloud`; or the column that is asked for is not there.
    """
    path, reader = reader_of(path)
    if point_times is None or point_times.origin == 'none':
        return read_cloud(path, columns), None
    with errors_of(path):
        every = np.asarray(reader(path, columns), dtype=np.float64)
        names = NAMES[path.suffix.lower()](path, columns) if path.suffix.lower() in NAMES else []
    usable = usable_points(every)[0]
    usable[usable] = near_the_rest(every[usable])
    points = read_cloud(path, columns)

    def found_in(column, name):
        with errors_of(path):
            values = np.asarray(reader(path, (column,) * 3))[:, 0]
        return times_of(values[usable], name, points, stamp, point_times)

    if point_times.origin == 'azimuth':
        read = first_times([lambda: azimuth_times(points, point_times)])
    else:
        chosen = _columns_of_times(path, names, point_times.field)
        read = first_times([lambda each=each: found_in(*each) for each in chosen])
    _warn(path, read)
    return points, read.times


def _columns_of_times(path, names, wanted):
    """Return [(column, name)] that may hold times, the likeliest first."""
    if wanted.isdecimal() and not any(names):
        return [(int(wanted), f'column {wanted}')]
    chosen = [names[i] for i in time_fields(names, wanted)]
    if wanted and len(chosen) != 1:
        shown = ', '.join(map(repr, names)) or 'without names; give a number'
        raise UnreadableCloud(
            f'{path} has no one column {wanted!r} of times; its columns: {shown}'
        )
    return [(name, name) for name in chosen if names.count(name) == 1]


def _warn(path, read):
    if read.times is None and read.said != NO_FIELD:
        logger.warning('%s: times of points: %s; taken as none', path, read.said)
    elif read.times is not None:
        logger.info('%s: times of points: %s', path, read.said)
