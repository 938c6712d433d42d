"""Read point clouds from files: PLY, PCD, text, KITTI and NumPy."""

import io
import logging
import re
import warnings
from pathlib import Path

import numpy as np

from idem_ros.core.exceptions import IdemError

KITTI_POINT = 16  # bytes: float32 x y z intensity
HEADER_SEARCHED = 4096
MOST_COLUMNS = 64  # of an array of points; more are points in columns

logger = logging.getLogger(__name__)


class UnreadableCloud(IdemError):
    """A file that holds no cloud that can be read."""


def read_cloud(path):
    """Read the usable points of a cloud file; what is left out is logged as a warning.

    Left out are points that are not finite, and exact zeros where there are several of them: how
    scanners fill what they did not measure.

    .ply (ascii, binary), .pcd (ascii, binary, binary_compressed), text (.xyz, .txt, .csv: columns
    named x, y, z in a header line, else the first three), .bin as KITTI has it (float32 x y z
    intensity), .npy ((N, 3) or more columns).

    Args:
        path: the file; its suffix says what it is.

    Returns:
        (N, 3) float64, N >= 1, in the file's unit and frame.

    Raises:
        UnreadableCloud: another suffix, no such file, damaged or cut off, or no usable point.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise UnreadableCloud(
            f'{path} is no cloud file that can be read: its suffix must be one of '
            f'{", ".join(READERS)}'
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')  # an empty file is reported below, in one line
            points = np.asarray(reader(path), dtype=np.float64)
    except OSError as error:
        raise UnreadableCloud(f'{path} cannot be read: {error.strerror or error}') from error
    except Exception as error:  # damaged bytes raise anything, from struct.error to KeyError
        reason = ' '.join(str(error).split()) or type(error).__name__
        raise UnreadableCloud(
            f'{path} cannot be read, it may be cut off or damaged: {reason}'
        ) from error
    return _usable(points, path)


def _usable(points, path):
    finite = np.isfinite(points).all(axis=1)
    zero = ~points.any(axis=1)
    padding = zero if zero.sum() > 1 else np.zeros_like(zero)  # one may be a point of a model
    usable = finite & ~padding
    if not usable.any():
        raise UnreadableCloud(
            f'{path} holds {len(points)} points and none is usable; '
            'at least one must be finite and not zero'
        )
    if not usable.all():
        logger.warning(
            '%s: of %d points %d are not finite and %d exactly zero, left out',
            *(path, len(points), len(points) - finite.sum(), padding.sum()),
        )
    return points[usable]


def _read_ply(path):
    from plyfile import PlyData

    return _columns(PlyData.read(path)['vertex'].data)


def _read_pcd(path):
    from pypcd4 import PointCloud

    content = path.read_bytes()
    header, rest = content[:HEADER_SEARCHED], content[HEADER_SEARCHED:]
    # pypcd4 refuses any VERSION but 0.7, yet files of PCL's own with .5 differ in nothing it reads
    header = re.sub(rb'^VERSION[ \t]+\S+', b'VERSION 0.7', header, count=1, flags=re.MULTILINE)
    cloud = PointCloud.from_fileobj(io.BytesIO(header + rest))
    if len(cloud.pc_data) != cloud.points:
        raise ValueError(f'{len(cloud.pc_data)} points where the header says {cloud.points}')
    return _columns(cloud.pc_data)


def _read_text(path):
    lines = path.read_text(encoding='utf-8-sig').replace(',', ' ').replace(';', ' ').splitlines()
    lines = [line for line in lines if line.strip() and not line.lstrip().startswith('#')]
    columns = (0, 1, 2)
    if lines and not _is_number(lines[0].split()[0]):
        names = [name.strip('"\'').lower() for name in lines.pop(0).split()]
        if set('xyz') <= set(names):
            columns = tuple(names.index(name) for name in 'xyz')
    return np.loadtxt(lines, usecols=columns, ndmin=2)


def _read_kitti(path):
    size = path.stat().st_size
    if size % KITTI_POINT:
        raise ValueError(
            f'its {size} bytes are no multiple of {KITTI_POINT} (float32 x y z intensity)'
        )
    return np.fromfile(path, dtype='<f4').reshape(-1, 4)[:, :3]


def _read_npy(path):
    array = np.load(path, allow_pickle=False)
    if array.dtype.names:
        return _columns(array)
    points_in_rows = array.ndim == 2 and 3 <= array.shape[1] <= MOST_COLUMNS
    if not points_in_rows or array.dtype.kind not in 'fiu':
        raise ValueError(
            f'it has shape {array.shape} and dtype {array.dtype}; it must be (N, 3), of numbers, '
            'a point a row'
        )
    return array[:, :3]


def _columns(table):
    """Stack the fields x, y, z of a structured array."""
    missing = [name for name in 'xyz' if name not in table.dtype.names]
    if missing:
        raise ValueError(f'it has no {", ".join(missing)} among its fields {table.dtype.names}')
    return np.stack([table[name].astype(np.float64) for name in 'xyz'], axis=1)


def _is_number(word):
    try:
        float(word)
    except ValueError:
        return False
    return True


READERS = {
    '.ply': _read_ply,
    '.pcd': _read_pcd,
    '.xyz': _read_text,
    '.txt': _read_text,
    '.csv': _read_text,
    '.bin': _read_kitti,
    '.npy': _read_npy,
}
