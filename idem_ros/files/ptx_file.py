"""Clouds as Leica's PTX: the scans of a project, each of a grid of points and in its pose."""

import logging

import numpy as np

from idem_ros.core.exceptions import InvalidTransform
from idem_ros.core.geometry.se3 import checked_transform, transform_points
from idem_ros.files.text_lines import numbered_lines, text_of
from idem_ros.files.unreadable import UnreadableCloud

HEAD = (1, 1, 3, 3, 3, 3, 4, 4, 4, 4)  # numbers in each line before the points of a scan
WIDTHS = (3, 4, 6, 7)  # numbers of a point: x y z, intensity, red green blue
MOST = 1e9  # columns or rows
SHOWN = 60  # characters of a line in a message

logger = logging.getLogger(__name__)


def read_ptx(path, columns=None):
    """Read (N, 3) points of all scans, each in its pose; nan where a ray met nothing."""
    if columns is not None:
        raise UnreadableCloud('--columns is for tables and .bin; this format says x, y and z')
    lines, _ = numbered_lines(text_of(path.read_bytes()))
    scans, at = [], 0
    while at < len(lines):
        points, at = _scan(lines, at)
        scans.append(points)
    if len(scans) > 1:
        logger.warning('%s: its %d scans are put together, each in its pose', path, len(scans))
    return np.vstack(scans) if scans else np.empty((0, 3))


def refuse_ptx(lines):
    """Refuse lines of a table that begin as PTX does.

    Raises:
        UnreadableCloud: it says what they are.
    """
    if [len(line.split()) for _, line in lines[: len(HEAD)]] == list(HEAD):
        raise UnreadableCloud('by its content it is a PTX; its name must end in .ptx')


def _scan(lines, at):
    """Return the (N, 3) points of the scan that begins at a line, and where the next begins."""
    head = [_numbers(lines, at + k, (width,)) for k, width in enumerate(HEAD)]
    (columns,), (rows,) = head[:2]
    if not all(0 <= n < MOST and n == int(n) for n in (columns, rows)):
        raise UnreadableCloud(f'{_quoted(lines[at])} and the next are no size of a grid')
    begin, count = at + len(HEAD), int(columns * rows)
    if begin + count > len(lines):
        raise UnreadableCloud(
            f'it is cut off: line {lines[at][0]} begins a scan of {count} points, and '
            f'{len(lines) - begin} lines follow'
        )
    try:  # a point is a row there: p' = (p, 1) M
        T_map_scan = checked_transform(np.transpose(head[6:]), 'the matrix')
    except InvalidTransform as error:
        raise UnreadableCloud(f'line {lines[at + 6][0]} begins no pose: {error}') from error
    points = _points(lines, begin, begin + count)
    points[(points == 0.0).all(axis=1)] = np.nan
    return transform_points(T_map_scan, points), begin + count


def _points(lines, begin, end):
    if begin == end:
        return np.empty((0, 3))
    try:
        rows = [line for _, line in lines[begin:end]]
        return np.loadtxt(rows, usecols=(0, 1, 2), ndmin=2, comments=None)
    except ValueError:  # once more and slowly, to name the line
        return np.array([_numbers(lines, k, WIDTHS)[:3] for k in range(begin, end)])


def _numbers(lines, at, widths):
    if at >= len(lines):
        raise UnreadableCloud('it is cut off before the points of a scan')
    try:
        numbers = [float(word) for word in lines[at][1].split()]
    except ValueError as error:
        raise UnreadableCloud(f'{_quoted(lines[at])} holds no numbers') from error
    if len(numbers) not in widths:
        wanted = ' or '.join(map(str, widths))
        raise UnreadableCloud(
            f'{_quoted(lines[at])} holds {len(numbers)} numbers; PTX has {wanted} there'
        )
    return numbers


def _quoted(row):
    return f'line {row[0]} ({row[1].strip()[:SHOWN]!r})'
