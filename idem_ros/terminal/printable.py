"""Names and texts of other people's, as a terminal, a table or a page may show them."""

from typing import Any

FORMULA = tuple('=+-@\t\r＝＋－＠')  # what a spreadsheet takes a cell for that begins so
MOST = 1500  # letters of a message: some lines of a terminal


def printable(text):
    """Return a text in one line without what is obeyed or hidden where it is shown.

    Control characters, line ends, directions of writing and lone bytes become escapes as Python
    spells them; what can be seen stays, in any script.
    """
    text = str(text)
    if text.isprintable():
        return text
    return ''.join(
        each if each.isprintable() else each.encode('unicode_escape').decode() for each in text
    )


def message_line(text):
    """Return a message as one line, `printable`; of a very long one the beginning and the end."""
    line = printable(text)
    if len(line) <= MOST:
        return line
    return f'{line[: 2 * MOST // 3]} ... {line[-MOST // 3 :]}'


def cell(value):
    """Return a cell of a CSV: a text as `printable`, quoted by ' where it would be a formula.

    Numbers stay numbers, also those that are given as text.
    """
    if not isinstance(value, str):
        return value
    text = printable(value)
    if not value.startswith(FORMULA):
        return text
    try:
        float(value)
    except ValueError:
        return f"'{text}"
    return text


class ShownStream:
    """A stream to a terminal that lets no control characters through but line ends and tabs.

    Args:
        stream: to write to; all but `write` is its own.
    """

    def __init__(self, stream: Any):
        self._stream = stream

    def __getattr__(self, name):
        return getattr(self._stream, name)

    def write(self, text):
        """Write a text, each of its lines `printable`."""
        self._stream.write(
            text
            if text.isprintable()
            else ''.join(each if each in '\n\t' else printable(each) for each in text)
        )
        return len(text)

    def writelines(self, lines):
        """Write several texts."""
        for line in lines:
            self.write(line)


def counted(count, noun):
    """Return a number with what it counts: 1 publisher, 2 publishers."""
    return f'{count} {noun}' if count == 1 else f'{count} {noun}s'


def error_line(error):
    """Return what an error of a library says as one line; its kind where it says nothing."""
    return ' '.join(str(error).split()).rstrip('.') or type(error).__name__
