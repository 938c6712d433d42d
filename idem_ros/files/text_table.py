"""Clouds as tables of text: one delimiter and one decimal sign a file, named columns or none."""

import csv
import io
import logging
import re
from dataclasses import dataclass

import numpy as np

from idem_ros.files.columns import numbered_columns, xyz_columns
from idem_ros.files.text_lines import COMMENT, numbered_lines, text_of
from idem_ros.files.unreadable import UnreadableCloud

SAMPLE = 200  # rows that the delimiter and the decimal sign are told by
SHOWN = 60  # characters of a line in a message
NUMBER = {
    sign: re.compile(rf'[+-]?(\d+([{sign}]\d*)?|[{sign}]\d+)([eE][+-]?\d+)?$') for sign in '.,'
}
GROUPED = re.compile(r'[+-]?\d{1,3}([.,]\d{3})+([.,]\d+)?$')
NO_NUMBER = re.compile(r'[+-]?(nan|inf|infinity|na|n/a|null|none)?$', re.IGNORECASE)
SEPARATOR = re.compile(r'"?sep=(.)"?$', re.IGNORECASE)  # how Excel says its delimiter
UNIT = re.compile(r'\s+([\[(])')
LEAST_TO_COUNT = 10  # rows
POINTS_FIRST = ('.pts', '.xyzn', '.xyzrgb')  # formats whose first three columns are x, y, z

logger = logging.getLogger(__name__)


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
    else:
        chosen = (0, 1, 2) if columns is None else numbered_columns(table.width, columns)
    points = _numbers(table, chosen)
    if table.names is None and columns is None and table.width > 3:
        _refuse_counter(points)
        if path.suffix.lower() not in POINTS_FIRST:
            logger.warning(
                '%s: no header says what its %d columns are: the first three are taken for '
                'x, y and z; --columns says others',
                *(path, table.width),
            )
    return points


def text_names(path, columns=None):
    """Return the names of the columns of a table; [] of one without."""
    return _table(*numbered_lines(text_of(path.read_bytes()))).names or []


def _table(lines, comments):
    """Find delimiter, counts of points, header and width."""
    given = SEPARATOR.match(lines[0][1]) if lines else None
    delimiter = given[1] if given else _delimiter(lines)
    lines = lines[1:] if given else lines
    counts = [(number, _lone(line)) for number, line in lines if _lone(line) is not None]
    rows = [row for row in lines if _lone(row[1]) is None] if counts else lines
    if not rows:
        raise UnreadableCloud('it holds no row of numbers')
    names = _header(rows, delimiter)
    header, rows = (None, rows) if names is None else (rows[0], rows[1:])
    _check_counts(counts, rows)
    if not rows:
        raise UnreadableCloud('it holds a header and no row of numbers')
    if not any(_is_number(cell) for cell in _split(rows[0][1], delimiter)):
        raise UnreadableCloud(f'{_quoted(rows[0])} is no point')
    width = _width(rows, delimiter)
    if header is not None:
        names = _fitting(names, width, header, rows[0])
    elif width >= 3:
        names = _commented(comments, rows[0][0], delimiter, width)
    return Table(rows, delimiter, names or None, width)


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
        return None if are_numbers and any(' ' in cell for cell in cells) else '\t'
    if not any(',' in row for row in rows):
        return None
    return None if are_numbers and len(words) >= 3 * len(rows) else ','


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
    numbers = sum(map(_is_number, cells))
    if numbers < 3 and not all(_is_number(cell) or NO_NUMBER.match(cell) for cell in cells):
        glued = UNIT.sub(r'\1', rows[0][1]) if delimiter is None else rows[0][1]
        return _split(glued.lstrip('#/%! '), delimiter)
    ordinals = [str(k) for k in range(len(cells))]
    if (
        len(rows) > 1
        and len(cells) > 2
        and re.search(r'[.,-]', ''.join(_split(rows[1][1], delimiter)))
    ):
        if cells == ordinals:  # pandas's names of what has none
            return []
        if cells == ['', *ordinals[:-1]]:
            return cells
    return None


def _fitting(names, width, header, row):
    """Return names, as many as the rows have cells."""
    if len(names) == width + 1 and names[-1] == '':
        names = names[:-1]
    if names and len(names) != width:
        raise UnreadableCloud(
            f'{_quoted(header)} names {len(names)} columns, and {_quoted(row)} holds {width}'
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


def _numbers(table, chosen):
    """Return (N, 3) numbers of three columns; a cell that is empty or says so is nan."""
    import pandas as pd

    sample = table.rows[:SAMPLE] + table.rows[-SAMPLE:]
    cells = [_split(line, table.delimiter) for _, line in sample]
    decimal, thousands = _signs([row[i] for row in cells for i in chosen])
    if table.delimiter == ',' and table.names is None:
        _refuse_torn(cells)
    lines = [line.strip() if table.delimiter is None else line for _, line in table.rows]
    layout = {
        'sep': table.delimiter or r'\s+',
        'header': None,
        'names': range(_count(lines[0], table.delimiter)),
        'usecols': sorted(set(chosen)),
        'index_col': False,
    }
    signs = {'decimal': decimal, 'thousands': thousands, 'float_precision': 'round_trip'}
    try:
        frame = pd.read_csv(io.StringIO('\n'.join(lines)), dtype=np.float64, **layout, **signs)
    except (ValueError, OverflowError, pd.errors.ParserError) as error:
        raise _offence(table, chosen, decimal, thousands) from error
    if len(frame) != len(lines):
        raise UnreadableCloud('a quotation mark opens and does not close in its line')
    return frame[list(chosen)].to_numpy()


def _offence(table, chosen, decimal, thousands):
    """Return the error that names the first cell which is no number."""
    for row in table.rows:
        for cell in (_split(row[1], table.delimiter)[i] for i in chosen):
            plain = cell.replace(thousands, '') if thousands else cell
            if not (NUMBER[decimal].match(plain) or NO_NUMBER.match(plain)):
                return UnreadableCloud(
                    f'{_quoted(row)} is no point: {cell[:SHOWN]!r} is no number'
                )
    return UnreadableCloud('its rows are no numbers')


def _signs(cells):
    """Return the decimal sign, and what groups thousands or None."""
    both = [cell for cell in cells if ',' in cell and '.' in cell]
    if both:
        last = {max(',.', key=cell.rfind) for cell in both}
        if len(last) == 1:
            decimal = last.pop()
            return decimal, ',' if decimal == '.' else '.'
    comma = next((cell for cell in cells if ',' in cell), None)
    point = next((cell for cell in cells if '.' in cell), None)
    if comma and point:
        raise UnreadableCloud(f'its decimal sign is a comma in {comma!r} and a point in {point!r}')
    return (',' if comma else '.'), None


def _refuse_torn(rows):
    """Refuse rows whose numbers a comma has torn apart: 3,0712 as 3 and 0712."""
    halves = [row[1::2] for row in rows]
    whole = all(cell.lstrip('+-').isdecimal() for row in rows for cell in row)
    if not whole or len(rows[0]) % 2:
        return
    lengths = [{len(cell) for cell in column} for column in zip(*halves, strict=True)]
    unsigned = all(cell.isdecimal() for row in halves for cell in row)
    alike = unsigned and all(len(each) == 1 and each != {1} for each in lengths)
    if (alike and len(rows) >= 5) or any(re.match('0[0-9]', c) for row in halves for c in row):
        raise UnreadableCloud(
            'a comma is both its decimal sign and its delimiter; it must be written with another '
            'delimiter, or with decimal points'
        )


def _refuse_counter(points):
    x = points[:, 0]
    steps = np.diff(x)
    if len(x) < LEAST_TO_COUNT or not steps.any() or (x != np.round(x)).any():
        return
    if set(steps) <= {0.0, 1.0}:
        raise UnreadableCloud(
            'no header says what its columns are, and the first counts rows; --columns says '
            'which are x, y and z, as 2,3,4'
        )


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


def _is_number(cell):
    known = NUMBER['.'], NUMBER[','], GROUPED
    return cell.lower() in ('nan', 'inf') or any(form.match(cell) for form in known)


def _quoted(row):
    number, line = row
    return (
        f'line {number} ({line[:SHOWN]!r})'
        if len(line) <= SHOWN
        else f'line {number} ({line[:SHOWN]!r}...)'
    )
