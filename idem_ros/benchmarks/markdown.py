"""Tables of Markdown that also read well as plain text."""


def table(header, rows):
    """Return a Markdown table: the first column to the left, the others to the right.

    Args:
        header: column titles.
        rows: sequences of cells, as long as the header; anything that `str` takes.
    """
    lines = [[str(cell).replace('|', '\\|') for cell in row] for row in [header, *rows]]
    widths = [max(3, *(len(line[k]) for line in lines)) for k in range(len(header))]
    ruler = ['-' * widths[0], *('-' * (width - 1) + ':' for width in widths[1:])]
    lines.insert(1, ruler)
    return '\n'.join(_line(line, widths) for line in lines) + '\n'


def number(value, scale=1.0):
    """Return a number with three digits; a dash where there is none."""
    return '-' if value is None else f'{scale * value:.3g}'


def _line(cells, widths):
    first = cells[0].ljust(widths[0])
    others = [cell.rjust(width) for cell, width in zip(cells[1:], widths[1:], strict=True)]
    return '| ' + ' | '.join([first, *others]) + ' |'
