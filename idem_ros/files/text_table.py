"""Clouds as tables of text: one delimiter and one decimal sign a file, named columns or none."""

import csv
import io
import re
from dataclasses import dataclass

import numpy as np

from idem_ros.files.columns import note_unit, numbered_columns, xyz_columns
from idem_ros.files.nameless import (
    LOOKED_AT,
    are_columns,
    note_first_three,
    refuse_no_coordinates,
)
from idem_ros.files.ptx_file import refuse_ptx
from idem_ros.files.text_lines import COMMENT, numbered_lines, text_of
from idem_ros.files.text_numbers import (
    NO_NUMBER,
    NUMBER,
    is_number,
    is_written,
    number_of,
    refuse_torn,
    signs_of,
)
from idem_ros.files.unreadable import UnreadableCloud

SAMPLE = 200  # rows that the delimiter and the decimal sign are told by
SHOWN = 60  # characters of a line in a message
SEPARATOR = re.compile(r'"?sep=(.)"?$', re.IGNORECASE)  # how Excel says its delimiter
UNIT = re.compile(r'\s+([\[(])')
BLANKS = re.compile(r'(?<![\d.,])\d{1,3}(?: \d{3})+(?:[.,]\d+)?(?![\d ])')  # 1 234 567,5
POINTS_FIRST = ('.pts', '.xyzn', '.xyzrgb')  # formats whose first three columns are x, y, z


@dataclass
class Table:
    """A table's rows of text, with what was found of its layout."""

    rows: list  # (line number, line)
    delimiter: str | None  # None: white space
    names: list | None
    width: int


def read_text(path, columns=None):
    """Read (N, 3) points of a table of text."""
    table = _table(*numbered_lines(text_of(path.read_bytes())))
    if isinstance(columns, int):
        raise UnreadableCloud('--columns of a text table are three names or numbers, as 2,3,4')
    if table.names:
        chosen = xyz_columns(table.names, columns)
        if columns is None:
            note_unit(path, [table.names[i] for i in chosen])
    else:
        if are_columns(len(table.rows), table.width):
            raise UnreadableCloud(
                f'it has {len(table.rows)} rows of {table.width} numbers; a point must be a row'
            )
        chosen = (0, 1, 2) if columns is None else numbered_columns(table.width, columns)
    points = _numbers(table, chosen)
    if table.names is None and columns is None and table.width > 3:
        refuse_no_coordinates(points[:, 0], _first_columns(table))
        if path.suffix.lower() not in POINTS_FIRST:
            note_first_three(path, table.width)
    return points


def text_names(path, columns=None):
    """Return the names of the columns of a table; [] of one without."""
    return _table(*numbered_lines(text_of(path.read_bytes()))).names or []


def _table(lines, comments):
    """Find delimiter, counts of points, header and width."""
    refuse_ptx(lines)
    given = SEPARATOR.match(lines[0][1]) if lines else None
    delimiter = given[1] if given else _delimiter(lines)
    lines = lines[1:] if given else lines
    if delimiter and any(BLANKS.search(line) for _, line in lines[-SAMPLE:]):
        lines = [(number, BLANKS.sub(_joined, line)) for number, line in lines]
    counts = [(number, _lone(line)) for number, line in lines if _lone(line) is not None]
    rows = [row for row in lines if _lone(row[1]) is None] if counts else lines
    if not rows:
        raise UnreadableCloud('it holds no row of numbers')
    names = _header(rows, delimiter)
    header, rows = (None, rows) if names is None else (rows[0], rows[1:])
    _check_counts(counts, rows)
    if not rows:
        raise UnreadableCloud('it holds a header and no row of numbers')
    if not any(is_number(cell) for cell in _split(rows[0][1], delimiter)):
        raise UnreadableCloud(f'{_quoted(rows[0])} is no point')
    width = _width(rows, delimiter)
    if header is not None:
        names = _fitting(names, width, header, rows)
    elif width >= 3:
        names = _commented(comments, rows[0][0], delimiter, width)
    return Table(rows, delimiter, names or None, width)


def _joined(grouped):
    return grouped[0].replace(' ', '')


def _delimiter(lines):
    """Return what separates the cells; None is white space."""
    rows = [line for _, line in lines[1:][-SAMPLE:] or lines if _lone(line) is None]
    for delimiter in ';|':
        if any(delimiter in row for row in rows):
            return delimiter
    words = [word for row in rows for word in row.split()]
    are_numbers = all(NUMBER[','].match(word) or NUMBER['.'].match(word) for word in words)
    if any('\t' in row for row in rows):
        cells = [cell.strip() for row in rows for cell in row.split('\t')]
        parted = [cell for cell in cells if ' ' in cell and not BLANKS.fullmatch(cell)]
        return None if are_numbers and parted else '\t'
    if not any(',' in row for row in rows):
        return None
    are_whole = are_numbers and not any(word.endswith(',') for word in words)
    return None if are_whole and len(words) >= 3 * len(rows) else ','


def _lone(line):
    """Return the whole number that a line holds and nothing else, how many points there are."""
    bare = line.strip(' \t;,|"')
    return int(bare) if bare.isdecimal() and len(bare) < 16 else None


def _check_counts(counts, rows):
    told = sum(count for _, count in counts)
    if counts and told != len(rows):
        raise UnreadableCloud(
            f'line {counts[0][0]} says {told} points and {len(rows)} follow: cut off, or no count'
            if len(counts) == 1
            else f'{len(counts)} lines say {told} points, and there are {len(rows)}'
        )


def _header(rows, delimiter):
    """Return the names of the first row, [] for a header that says nothing; None for no header."""
    cells = _split(rows[0][1], delimiter)
    numbers = sum(map(is_number, cells))
    if numbers < 3 and not all(is_number(cell) or NO_NUMBER.match(cell) for cell in cells):
        glued = UNIT.sub(r'\1', rows[0][1]) if delimiter is None else rows[0][1]
        return _split(glued.lstrip('#/%! '), delimiter)
    ordinals = [str(k) for k in range(len(cells) + 1)]
    if (
        len(rows) > 1
        and len(cells) > 2
        and re.search(r'[.,-]', ''.join(_split(rows[1][1], delimiter)))
    ):
        if cells in (ordinals[:-1], ordinals[1:]):  # as pandas or R names what has no name
            return []
        if cells == ['', *ordinals[:-2]]:
            return cells
    return None


def _fitting(names, width, header, rows):
    """Return names, as many as the rows have cells; quoted names of rows (R) have none."""
    if len(names) == width + 1 and names[-1] == '':
        names = names[:-1]
    if len(names) == width - 1 and all(line.lstrip().startswith('"') for _, line in rows):
        names = ['', *names]
    if names and len(names) != width:
        raise UnreadableCloud(
            f'{_quoted(header)} names {len(names)} columns, and {_quoted(rows[0])} holds {width}'
        )
    return names


def _commented(comments, first, delimiter, width):
    """Return the names that a comment before the first row gives; None where none does."""
    for _, comment in reversed([each for each in comments if each[0] < first]):
        bare = UNIT.sub(r'\1', comment.lstrip(''.join(COMMENT) + ' '))
        for cells in (_split(bare, delimiter), re.split(r'[,;\s]+', bare)):
            cells = cells[:-1] if cells[-1] == '' else cells
            if len(cells) == width and {'x', 'y', 'z'} <= {cell.lower() for cell in cells}:
                return cells
            if len(cells) == width and _names_points(cells):
                return cells
    return None


def _names_points(cells):
    try:
        xyz_columns(cells)
    except UnreadableCloud:
        return False
    return True


def _width(rows, delimiter):
    """Return how many cells every row has; a delimiter at the end of all is none."""
    widths = [_count(line, delimiter) for _, line in rows]
    if len(set(widths)) > 1:
        usual = max(set(widths), key=widths.count)
        odd = next(i for i, width in enumerate(widths) if width != usual)
        raise UnreadableCloud(
            f'{_quoted(rows[odd])} holds {widths[odd]} cells, where others hold {usual}'
        )
    if delimiter and all(line.rstrip(' ').endswith(delimiter) for _, line in rows):
        widths[0] -= 1
    if widths[0] < 3:
        raise UnreadableCloud(f'{_quoted(rows[0])} is no point: it must hold three numbers')
    return widths[0]


def _first_columns(table):
    """Return (M, K) numbers of the first columns of some rows; nan where a cell is none."""
    rows = [_split(line, table.delimiter)[:LOOKED_AT] for _, line in table.rows[:SAMPLE]]
    return np.array([[number_of(cell) for cell in row[: table.width]] for row in rows])


def _numbers(table, chosen):
    """Return (N, 3) numbers of three columns; a cell that is empty or says so is nan."""
    import pandas as pd

    sample = table.rows[:SAMPLE] + table.rows[-SAMPLE:]
    cells = [_split(line, table.delimiter) for _, line in sample]
    decimal, thousands = signs_of([row[i] for row in cells for i in chosen])
    if table.delimiter == ',' and table.names is None:
        refuse_torn(cells)
    lines = [line.strip() if table.delimiter is None else line for _, line in table.rows]
    layout = {
        'sep': table.delimiter or r'\s+',
        'header': None,
        'names': range(_count(lines[0], table.delimiter)),
        'usecols': sorted(set(chosen)),
        'index_col': False,
    }
    if thousands and (offence := _offence(table, chosen, decimal, thousands)):
        raise offence
    signs = {'decimal': decimal, 'thousands': thousands, 'float_precision': 'round_trip'}
    try:
        frame = pd.read_csv(io.StringIO('\n'.join(lines)), dtype=np.float64, **layout, **signs)
    except (ValueError, OverflowError, pd.errors.ParserError) as error:
        offence = _offence(table, chosen, decimal, thousands)
        raise offence or UnreadableCloud('its rows are no numbers') from error
    if len(frame) != len(lines):
        raise UnreadableCloud('a quotation mark opens and does not close in its line')
    return frame[list(chosen)].to_numpy()


def _offence(table, chosen, decimal, thousands):
    """Return the error that names the first cell which is no number; None where all are."""
    for row in table.rows:
        for cell in (_split(row[1], table.delimiter)[i] for i in chosen):
            if not is_written(cell, decimal, thousands):
                return UnreadableCloud(
                    f'{_quoted(row)} is no point: {cell[:SHOWN]!r} is no number'
                )
    return None


def _split(line, delimiter):
    if delimiter is None and '"' not in line:
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(delimiter)]
    words = line if delimiter else ' '.join(line.split())
    reader = csv.reader([words], delimiter=delimiter or ' ', skipinitialspace=True)
    return [cell.strip() for cell in next(reader)]


def _count(line, delimiter):
    if '"' in line:
        return len(_split(line, delimiter))
    return len(line.split()) if delimiter is None else line.count(delimiter) + 1


def _quoted(row):
    number, line = row
    return (
        f'line {number} ({line[:SHOWN]!r})'
        if len(line) <= SHOWN
        else f'line {number} ({line[:SHOWN]!r}...)'
    )
