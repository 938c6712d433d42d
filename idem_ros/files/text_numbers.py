"""What is a number in a table of text, and what makes a table's numbers doubtful."""

import re

from idem_ros.files.unreadable import UnreadableCloud

NUMBER = {
    sign: re.compile(rf'[+-]?(\d+([{sign}]\d*)?|[{sign}]\d+)([eE][+-]?\d+)?$') for sign in '.,'
}
GROUPED = re.compile(r'[+-]?\d{1,3}([.,]\d{3})+([.,]\d+)?$')
LEAST_TO_STRIP = 50  # rows
NO_NUMBER = re.compile(r'[+-]?(nan|inf|infinity|na|n/a|null|none)?$', re.IGNORECASE)


def is_number(cell):
    """Return whether a cell of text is a number, with either decimal sign."""
    known = NUMBER['.'], NUMBER[','], GROUPED
    return cell.lower().lstrip('+-') in ('nan', 'inf') or any(form.match(cell) for form in known)


def number_of(cell):
    """Return the number that a cell of text is with either decimal sign; nan where it is none."""
    known = NUMBER['.'].match(cell) or NUMBER[','].match(cell)
    return float(cell.replace(',', '.')) if known else float('nan')


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
    # a desktop that writes no zero at the end of a fraction writes none in any
    stripped = unsigned and not any(cell.endswith('0') for row in halves for cell in row)
    torn = (alike and len(rows) >= 5) or (stripped and len(rows) >= LEAST_TO_STRIP)
    if torn or any(re.match('0[0-9]', c) for row in halves for c in row):
        raise UnreadableCloud(
            'a comma is both its decimal sign and its delimiter; it must be written with another '
            'delimiter, or with decimal points'
        )
