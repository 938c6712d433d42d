"""What is a number in a table of text, and what makes a table's numbers doubtful."""

import re

import numpy as np

from idem_ros.files.unreadable import UnreadableCloud

NUMBER = {
    sign: re.compile(rf'[+-]?(\d+([{sign}]\d*)?|[{sign}]\d+)([eE][+-]?\d+)?$') for sign in '.,'
}
GROUPED = re.compile(r'[+-]?\d{1,3}([.,]\d{3})+([.,]\d+)?$')
NO_NUMBER = re.compile(r'[+-]?(nan|inf|infinity|na|n/a|null|none)?$', re.IGNORECASE)
LEAST_TO_COUNT = 10  # rows
MOST_COLUMNS = 64  # of a table or array of points; more are points in columns
SHORT = 12  # columns; a few points of many channels have as many as rows


def is_number(cell):
    """Return whether a cell of text is a number, with either decimal sign."""
    known = NUMBER['.'], NUMBER[','], GROUPED
    return cell.lower() in ('nan', 'inf') or any(form.match(cell) for form in known)


def is_written(cell, decimal, thousands):
    """Return whether a cell is a number with these signs, or says that it is none."""
    if thousands and thousands in cell:
        whole = cell.split(decimal)[0]
        if not re.match(rf'[+-]?\d{{1,3}}({re.escape(thousands)}\d{{3}})+$', whole):
            return False
        cell = cell.replace(thousands, '')
    return bool(NUMBER[decimal].match(cell) or NO_NUMBER.match(cell))


def signs_of(cells):
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


def refuse_torn(rows):
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


def refuse_counter(points):
    """Refuse points (N, 3) whose first column counts rows."""
    x = points[:, 0]
    steps = np.diff(x)
    if len(x) < LEAST_TO_COUNT or not steps.any() or (x != np.round(x)).any():
        return
    if set(steps) <= {0.0, 1.0}:
        raise UnreadableCloud(
            'no header says what its columns are, and the first counts rows; --columns says '
            'which are x, y and z, as 2,3,4'
        )


def are_columns(rows, width):
    """Return whether a table of so many rows and columns holds a point a column, not a row."""
    return width > MOST_COLUMNS or width > max(rows, SHORT)
