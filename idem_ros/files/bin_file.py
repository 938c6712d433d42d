"""Clouds as bare numbers (KITTI, nuScenes): which layout, is told by the numbers themselves.

Nothing in such a file says how many columns it has. Read with the wrong number, every column mixes
coordinates with intensities; read with the right one, each is of one kind, and a scanner's points
come in an order in which neighbours are alike. So the layout is that in which values a column
apart differ least, and where none stands out the user must say.
"""

from typing import NamedTuple

import numpy as np

from idem_ros.files.unreadable import UnreadableCloud

COLUMNS = (3, 4, 5, 6)
NUSCENES = 5
LOOKED_AT = range(1, 13)  # columns, to notice what is none of these
SAMPLE = 120_000  # numbers
PLAUSIBLE = 0.98  # of the numbers must be such as coordinates and what goes with them are
LEAST, MOST = 1e-6, 1e8
CLEAR = 0.12  # of the mean logarithm of differences: real layouts stand out by 0.3 and more
FAR = 0.5  # of the same: from here on twice the columns are none by chance
CHANCE = 2.0  # standard errors of such a mean, about
TINY = 1e-9


class Layout(NamedTuple):
    """How many columns of which numbers."""

    dtype: str
    columns: int

    def __str__(self):
        return f'{self.columns} columns of {"float32" if self.dtype == "<f4" else "float64"}'


def read_bin(path, columns=None):
    """Read the first three of 3 to 6 columns of float32 or float64."""
    content = path.read_bytes()
    if columns is not None and not isinstance(columns, int):
        raise UnreadableCloud('--columns of a .bin is how many it has')
    is_nuscenes = path.name.lower().endswith('.pcd.bin')
    wanted = columns or (NUSCENES if is_nuscenes else None)
    layout = _layout(content, wanted)
    return np.frombuffer(content, layout.dtype).reshape(-1, layout.columns)[:, :3]


def _layout(content, wanted):
    dtype = _kind_of_numbers(content)
    layouts = [
        Layout(dtype, count)
        for count in ((wanted,) if wanted else COLUMNS)
        if dtype and len(content) % (count * np.dtype(dtype).itemsize) == 0 and count >= 3
    ]
    if not layouts:
        what = f'{wanted} columns' if wanted else '3 to 6 columns'
        raise UnreadableCloud(
            f'its {len(content)} bytes are no float32 or float64 of {what} that could be points; '
            '--columns says how many it has'
        )
    return layouts[0] if wanted else _told_apart(content, layouts)


def _told_apart(content, layouts):
    """Return the layout whose columns are each of one kind."""
    unlike = {each: _unlike(content, each) for each in layouts}
    best = min(layouts, key=lambda each: unlike[each])
    others = [each for each in layouts if each.columns % best.columns]
    # twice the columns are as good but for chance, for every second is the same
    half = [each for each in layouts if best.columns == 2 * each.columns]
    rows = len(content) / (np.dtype(best.dtype).itemsize * best.columns)
    chance = CHANCE / np.sqrt(rows)
    if half and unlike[half[0]] < unlike[best] + min(chance, FAR):
        best, others = half[0], [each for each in others if each != half[0]]
    elif half and unlike[half[0]] < unlike[best] + FAR:
        others += half
    if any(unlike[each] < unlike[best] + (FAR if each in half else CLEAR) for each in others):
        raise UnreadableCloud(
            f'it may be {" or ".join(str(each) for each in layouts)}; --columns says how many'
        )
    _refuse_strangers(content, best, unlike[best])
    return best


def _refuse_strangers(content, best, unlike):
    """Refuse numbers that are each of one kind in so many columns as are not looked for."""
    strangers = [Layout(best.dtype, n) for n in LOOKED_AT if n != best.columns]
    nearest = min(strangers, key=lambda each: _unlike(content, each))
    # by chance a multiple of the columns is a little better
    margin = CLEAR if nearest.columns % best.columns else FAR
    if _unlike(content, nearest) >= unlike - margin:
        return
    if nearest.columns == 1:
        raise UnreadableCloud(
            'its numbers look like all x, then all y and z; a point must be 3 to 6 of them'
        )
    row = np.dtype(nearest.dtype).itemsize * nearest.columns
    is_whole = nearest.columns > 2 and len(content) % row == 0
    why = '' if is_whole else f', of which its {len(content)} bytes are no whole number'
    raise UnreadableCloud(f'its numbers look like {nearest}{why}; --columns says how many it has')


def _unlike(content, layout):
    """Return the mean logarithm of how much a column's values differ from the next one's."""
    numbers = np.frombuffer(content, layout.dtype)[:SAMPLE]
    rows = numbers[: len(numbers) // layout.columns * layout.columns].reshape(-1, layout.columns)
    if len(rows) < 2:
        return 0.0
    rows = np.nan_to_num(rows.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0)
    return float(np.log(np.abs(np.diff(rows, axis=0)).mean(axis=0) + TINY).clip(-8, None).mean())


def _kind_of_numbers(content):
    """Return '<f4' or '<f8'; None: such numbers are no coordinates."""
    plausible = [dtype for dtype in ('<f4', '<f8') if _is_plausible(content, dtype)]
    if len(plausible) < 2:
        return plausible[0] if plausible else None
    # as float32, doubles are plausible where they are whole: every second is then 0
    return '<f8' if (np.frombuffer(content, '<f4')[:SAMPLE:2] == 0.0).mean() > 0.5 else '<f4'


def _is_plausible(content, dtype):
    size = np.dtype(dtype).itemsize
    if len(content) % size:
        return False
    sizes = np.abs(np.frombuffer(content, dtype)[:SAMPLE].astype(np.float64))
    fine = ((sizes >= LEAST) & (sizes <= MOST)) | (sizes == 0.0) | np.isnan(sizes)
    return bool(len(sizes)) and fine.mean() >= PLAUSIBLE and sizes.any()
