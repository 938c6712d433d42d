"""Text files of any encoding as lines without comments."""

import re

from idem_ros.files.unreadable import UnreadableCloud

MARKS = {b'\xef\xbb\xbf': 'utf-8-sig', b'\xff\xfe': 'utf-16', b'\xfe\xff': 'utf-16'}
NOTE = re.compile(r'[ \t]+#([ \t].*)?$')  # after a row; without a blank it may be a colour
MINUS = '\N{MINUS SIGN}'  # of Swedish and Norwegian desktops
GROUPS = "'\N{RIGHT SINGLE QUOTATION MARK}\N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}"
GROUPED = re.compile(rf'(?<![\d.,])\d{{1,3}}(?:[{GROUPS}]\d{{3}})+(?![\d{GROUPS}])')
NO_NUMBER = re.compile(  # as Windows and Excel write it
    r'\bnan\((?:ind|snan)\)|\b1[.,]#(?:ind|qnan|snan|inf)\w*'
    r'|(?:(?<=^)|(?<=[;,\t|]))#(?:n/a|n/d|nv|\w{3,7}!|div/0!)(?=$|[;,\t|\r])',
    re.IGNORECASE | re.MULTILINE,
)
NO_NUMBER_IN_BYTES = re.compile(NO_NUMBER.pattern.encode(), re.IGNORECASE | re.MULTILINE)
COMMENT = ('#', '//', '%', '!')


def with_plain_nans(content):
    """Return bytes of text in which what is no number is called nan, however it was written."""
    return NO_NUMBER_IN_BYTES.sub(b'nan', content)


def text_of(content):
    """Return bytes as text, by their byte order mark; without one UTF-8, else Windows-1252.

    Raises:
        UnreadableCloud: they are no text.
    """
    encoding = next((name for mark, name in MARKS.items() if content.startswith(mark)), 'utf-8')
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError as error:
        if encoding != 'utf-8':
            raise UnreadableCloud(f'it is no text in {encoding}: {error.reason}') from error
        text = content.decode('cp1252', errors='replace')
    if '\x00' in text:
        raise UnreadableCloud('it is no text: there are zero bytes in it')
    text = NO_NUMBER.sub('nan', text.replace(MINUS, '-'))
    return GROUPED.sub(_digits, text) if any(sign in text for sign in GROUPS) else text


def _digits(grouped):
    """Return a whole number without what groups it in Switzerland (1'234) and France."""
    return ''.join(filter(str.isdecimal, grouped[0]))


def numbered_lines(text):
    """Return (line number, line) of what is neither blank nor a comment, and the comments."""
    lines, comments = [], []
    for number, line in enumerate(re.split(r'\r\n|\r|\n', text), start=1):
        bare = line.strip(' \ufeff\x1a')
        if bare.startswith(COMMENT):
            comments.append((number, bare))
        elif bare.strip():
            lines.append((number, NOTE.sub('', bare) if '#' in bare else bare))
    return lines, comments
