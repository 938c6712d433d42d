"""Clouds as NumPy saves several arrays in one file (.npz): the one that holds points."""

import io
import re
import zipfile
import zlib

import numpy as np

from idem_ros.files.npy_file import check_npy, first_points_of
from idem_ros.files.unreadable import UnreadableCloud

TOKEN = re.compile(r'[a-z]+')
OF_POINTS = {'point', 'points', 'xyz', 'cloud', 'pointcloud', 'pcloud', 'pc', 'pcd', 'coords'}
OF_POINTS |= {'coord', 'coordinates', 'position', 'positions', 'pos', 'vertices'}
MOST_INFLATED = 100  # times; measured coordinates shrink to a half at best
MOST_ARRAYS, SHOWN = 1000, 12
BROKEN = (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError)


def read_npz(path, columns=None):
    """Read (N, 3) points of the only array, of the one called points or alike, or of x, y and z.

    Nothing is inflated that is larger than any points could be.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = {info.filename.removesuffix('.npy'): info for info in archive.infolist()}
            if len(members) > MOST_ARRAYS:
                raise UnreadableCloud(f'it holds {len(members)} arrays, too many for points')
            names = _chosen(list(members))
            arrays = [_array(archive, members[name], name) for name in names]
    except BROKEN as error:
        raise UnreadableCloud('it is cut off, damaged or no .npz of NumPy') from error
    if len(arrays) == 1:
        return first_points_of(arrays[0], columns, path)
    are_numbers = all(array.dtype.kind in 'fiu' for array in arrays)
    if not are_numbers or len({array.shape for array in arrays}) > 1:
        raise UnreadableCloud('its arrays x, y and z are not of one shape, or no numbers')
    return np.stack([array.ravel().astype(np.float64) for array in arrays], axis=1)


def _chosen(names):
    """Return the names of the arrays that are points: one, or x, y and z."""
    axes = [name for name in sorted(names) if name.lower() in ('x', 'y', 'z')]
    if [name.lower() for name in axes] == ['x', 'y', 'z']:
        return axes
    said = [name for name in names if OF_POINTS & set(TOKEN.findall(name.lower())[-1:])]
    exact = [name for name in said if name.lower() in OF_POINTS]
    for found in (names, said, exact):
        if len(found) == 1:
            return found
    shown = ', '.join(repr(name[:40]) for name in names[:SHOWN])
    more = f' and {len(names) - SHOWN} more' if len(names) > SHOWN else ''
    raise UnreadableCloud(
        f'its arrays are {shown or "none"}{more}; one must be called points, or three x, y and z'
    )


def _array(archive, info, name):
    if info.file_size > MOST_INFLATED * max(info.compress_size, 1):
        raise UnreadableCloud(
            f'its array {name[:40]!r} would inflate from {info.compress_size} to {info.file_size} '
            'bytes, as no points do'
        )
    stream = io.BytesIO(archive.read(info))
    check_npy(stream, len(stream.getvalue()))
    return np.load(stream, allow_pickle=False)
