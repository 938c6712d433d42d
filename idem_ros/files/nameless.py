"""Tables without names: whether their first three columns plainly are no x, y and z."""

import logging

import numpy as np

from idem_ros.files.unreadable import UnreadableCloud

LEAST_TO_COUNT = 10  # rows
MOST_COLUMNS = 64  # of a table or array of points; more are points in columns
SHORT = 12  # columns; a few points of many channels have as many as rows
MOST_BEFORE = 3  # columns of whole numbers that may come before x, y and z: scan, row and column
LOOKED_AT = MOST_BEFORE + 3  # columns
EVEN = 0.01  # of the mean step: times of a scanner differ by less, sorted coordinates by more
SAME = 1e-3  # of a distance, and in its unit: as it may be rounded
NO_LENGTH = 1e8  # times in seconds and below are larger, coordinates on the Earth smaller

logger = logging.getLogger(__name__)


def are_columns(rows, width):
    """Return whether a table of so many rows and columns holds a point a column, not a row."""
    return width > MOST_COLUMNS or width > max(rows, SHORT)


def refuse_no_coordinates(first, rows):
    """Refuse a table without names whose first column counts, names or times its points.

    Args:
        first: (N,) float64, its first column.
        rows: (M, K) float64 of some of its rows, `LOOKED_AT` columns or fewer; nan is no number.

    Raises:
        UnreadableCloud: it says so, and the option that chooses other columns.
    """
    if what := _counted(first) or _numbered(rows) or _ranged(rows):
        raise UnreadableCloud(
            f'no header says what its columns are, and {what}; --columns says which are x, y and '
            'z, as 2,3,4'
        )


def note_first_three(path, width):
    """Say that of so many columns without names the first three are taken."""
    logger.warning(
        '%s: no header says what its %d columns are: the first three are taken for '
        'x, y and z; --columns says others',
        *(path, width),
    )


def _counted(first):
    steps = np.diff(first)
    if len(first) < LEAST_TO_COUNT or not (steps >= 0.0).all():
        return ''
    if first[0] > NO_LENGTH:
        return 'the first rises as times do'
    is_count = (first == np.round(first)).all() and set(steps) <= {0.0, 1.0}
    is_even = is_count or np.ptp(steps) <= EVEN * steps.mean()
    if not is_even or not steps.any():
        return ''
    return 'the first counts rows' if is_count else 'the first rises evenly, as times do'


def _numbered(rows):
    """Say that whole numbers come before three columns of others."""
    whole = (rows == np.round(rows)).all(axis=0)
    broken = (np.isfinite(rows) & (rows != np.round(rows))).mean(axis=0) > 0.5
    for before in range(1, min(MOST_BEFORE, rows.shape[1] - 3) + 1):
        if len(rows) > 1 and whole[:before].all() and broken[before : before + 3].all():
            which = 'the first holds' if before == 1 else f'the first {before} hold'
            return f'{which} whole numbers and the three that follow do not'
    return ''


def _ranged(rows):
    """Say that the first column is the distance of the points that three others are."""
    for begin in range(1, rows.shape[1] - 2):
        distances = np.sqrt(np.square(rows[:, begin : begin + 3]).sum(axis=1))
        if len(rows) > 1 and distances.any() and np.allclose(distances, rows[:, 0], SAME, SAME):
            return f'the first is the distance of the points of columns {begin + 1} to {begin + 3}'
    return ''
