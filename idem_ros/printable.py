"""Names and texts of other people's, as a terminal, a table or a page may show them."""

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
