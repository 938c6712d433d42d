"""Tables of Markdown that also read well as plain text."""

from idem_ros.terminal.printable import printable


def table(header, rows, left=1):
    """Return a Markdown table: the first columns to the left, the others to the right.

    Args:
        header: column titles.
        rows: sequences of cells, as long as the header; anything that `str` takes.
        left: how many columns hold words.
    """
    lines = [[printable(cell).replace('|', '\\|') for cell in row] for row in [header, *rows]]
    widths = [max(3, *(len(line[k]) for line in lines)) for k in range(len(header))]
    rulers = ['-' * w if k < left else '-' * (w - 1) + ':' for k, w in enumerate(widths)]
    lines.insert(1, rulers)
    return '\n'.join(_line(line, widths, left) for line in lines) + '\n'


def number(value, scale=1.0):
    """Return a number with three digits; a dash where there is none."""
    return '-' if value is None else f'{scale * value:.3g}'


def _line(cells, widths, left):
    padded = [
        cell.ljust(width) if k < left else cell.rjust(width)
        for k, (cell, width) in enumerate(zip(cells, widths, strict=True))
    ]
    return '| ' + ' | '.join(padded) + ' |'
