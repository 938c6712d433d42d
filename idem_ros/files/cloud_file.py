"""Read point clouds from files, in the layouts that scanners, drivers and libraries write."""

import logging
import warnings
from collections.abc import Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.exceptions import IdemError
from idem_ros.core.metric.measured_points import FARTHEST, near_the_rest
from idem_ros.files.bin_file import read_bin
from idem_ros.files.content_kind import PACKED, UNPACK, refuse_other_kind
from idem_ros.files.npy_file import npy_parts, read_npy
from idem_ros.files.npz_file import read_npz
from idem_ros.files.pcd_file import pcd_parts, read_pcd
from idem_ros.files.ply_file import read_ply
from idem_ros.files.ptx_file import read_ptx
from idem_ros.files.survey_files import las_parts, read_e57, read_las
from idem_ros.files.text_table import read_text
from idem_ros.files.unreadable import UnreadableCloud, refuse_special
from idem_ros.terminal.printable import error_line

READERS = {
    '.ply': read_ply,
    '.pcd': read_pcd,
    '.xyz': read_text,
    '.xyzn': read_text,
    '.xyzrgb': read_text,
    '.txt': read_text,
    '.csv': read_text,
    '.tsv': read_text,
    '.pts': read_text,
    '.asc': read_text,
    '.ptx': read_ptx,
    '.bin': read_bin,
    '.npy': read_npy,
    '.npz': read_npz,
    '.las': read_las,
    '.laz': read_las,
    '.e57': read_e57,
}
KINDS = ' '.join(READERS)
IN_PARTS = {'.pcd': pcd_parts, '.npy': npy_parts, '.las': las_parts, '.laz': las_parts}
PART = 2**20  # points

logger = logging.getLogger(__name__)


def read_cloud(
    path: str | PathLike[str], columns: int | Sequence[str] | Sequence[int] | None = None
) -> NDArray[np.float64]:
    """Read the usable points of a cloud file; what is left out is logged as a warning.

    Left out are points that are not finite, exact zeros where there are several of them (how
    scanners fill what they did not measure), and strays, see `near_the_rest`.

    .ply and .pcd in all their encodings; .npy of (N, 3) or more columns, or with fields x, y, z;
    .npz with such an array; .bin of float32 or float64 in 3 to 6 columns; .ptx; .las, .laz, .e57
    (extra `survey`); tables of text (.xyz .txt .csv .tsv .pts .asc ...), whose header names x, y,
    z, else their first columns.

    Args:
        path: the file; its suffix says what it is.
        columns: for a table or fields, the three that are x, y, z: their names, or numbers from
            1; for .bin, how many there are. None: as the file says.

    Returns:
        (N, 3) float64, N >= 1, in the file's unit and frame.

    Raises:
        UnreadableCloud: another suffix, no such file, no file, damaged or cut off, a layout that
            cannot be told, or no usable point.
    """
    path, reader = reader_of(path)
    with errors_of(path):
        points = np.asarray(reader(path, columns), dtype=np.float64)
    (usable,) = _usable([points], path)
    near = near_the_rest(usable)
    if near.all():
        return usable
    logger.warning(
        '%s: of %d points %d are far from all the rest, left out',
        *(path, len(near), len(near) - int(near.sum())),
    )
    return usable[near]


def cloud_parts(path, columns=None):
    """Yield the usable points of a cloud file in parts, where its format lets them be read so.

    Args:
        path, columns: see `read_cloud`.

    Yields:
        (N, 3) float64, N >= 1; put together they are what `read_cloud` returns, and strays.

    Raises:
        UnreadableCloud: see `read_cloud`; the parts before what is damaged came already.
    """
    path, reader = reader_of(path)
    in_parts = IN_PARTS.get(path.suffix.lower())
    whole = (reader(path, columns) for _ in range(1))
    yield from _usable(_each(in_parts(path, columns, PART) if in_parts else whole, path), path)


def _each(parts, path):
    """Yield parts; whatever goes wrong while one is read names the file."""
    while True:
        with errors_of(path):
            points = next(parts, None)
        if points is None:
            return
        yield np.asarray(points, dtype=np.float64)


def reader_of(path):
    """Return the `Path` of a cloud file and what reads it.

    Raises:
        UnreadableCloud: another suffix, or no such file.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if path.is_dir():
        raise UnreadableCloud(f'{path} is a folder; it must be a cloud file')
    if reader is None:
        what = UNPACK if path.suffix.lower() in PACKED else 'its suffix must be one of '
        what += '' if what == UNPACK else ', '.join(READERS)
        raise UnreadableCloud(f'{path} is no cloud file that can be read: {what}')
    refuse_special(path, UnreadableCloud)
    return path, reader


@contextmanager
def errors_of(path):
    """Let whatever goes wrong while a file is read name it."""
    try:
        if path.is_file() and path.stat().st_size == 0:
            raise UnreadableCloud('it is empty')
        if path.is_file():
            refuse_other_kind(path)
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')
            yield
    except IdemError as error:
        raise UnreadableCloud(f'{path} cannot be read: {error}') from error
    except OSError as error:
        raise UnreadableCloud(f'{path} cannot be read: {error.strerror or error}') from error
    except Exception as error:  # damaged bytes raise anything, from struct.error to KeyError
        reason = error_line(error)[:200]
        raise UnreadableCloud(
            f'{path} cannot be read, it may be cut off or damaged: {reason}'
        ) from error


def usable_points(points):
    """Return which of points (N, 3) are usable, which are finite, and which are padding; (N,).

    What is farther than any measurement counts as not finite.
    """
    with np.errstate(invalid='ignore'):  # NaNs that signal
        finite = (np.abs(points) < FARTHEST).all(axis=1)
        zero = (points == 0.0).all(axis=1)
    padding = zero if zero.sum() > 1 else np.zeros_like(zero)  # one may be of a model
    return finite & ~padding, finite, padding


def _usable(parts, path):
    """Yield what of the parts of a file is usable; say at the end what was not."""
    count = nonfinite = padded = 0
    for points in parts:
        usable, finite, padding = usable_points(points)
        count += len(points)
        nonfinite += len(points) - int(finite.sum())
        padded += int(padding.sum())
        if usable.any():
            yield points if usable.all() else points[usable]
    if nonfinite + padded == count:
        raise UnreadableCloud(
            f'{path} holds {count} points and none is usable; '
            'at least one must be finite and not zero'
        )
    if nonfinite + padded:
        logger.warning(
            '%s: of %d points %d are not finite and %d exactly zero, left out',
            *(path, count, nonfinite, padded),
        )
