"""Rows of text that are poses or parts of them, as words; names above them say their order."""

import re
from contextlib import suppress
from decimal import Decimal, InvalidOperation

from idem_ros.core.exceptions import IdemError
from idem_ros.files.text_lines import numbered_lines, text_of

ORDER = ('t', 'x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')  # of a TUM line
TUM_NUMBERS = len(ORDER)
DECIMAL = re.compile(r'[+-]?\d+(,\d+)?([eE][+-]?\d+)?$')
NUMBER = re.compile(r'[+-]?(\d+\.?\d*|\.\d+|nan|inf)([eE][+-]?\d+)?$', re.IGNORECASE)
BRACKETS = re.compile(r'\barray\(|[\[\]()]')  # as numpy and MATLAB print matrices
W_FIRST = re.compile(r'\bq\w*w\b.*\bq\w*x\b', re.IGNORECASE)  # as EuRoC has it
UNIT = re.compile(r'[\[(]\s*(\w*)[^\])]*[\])]')
TOKEN = re.compile(r'[a-z]+')
TIMES = {'t', 'time', 'times', 'stamp', 'timestamp', 'sec', 'secs', 'seconds'}
POSITIONS = {'p', 'pos', 'position', 't', 'trans', 'translation'}
ROTATIONS = {'q', 'quat', 'quaternion', 'orientation', 'rot', 'rotation'}
POWERS = {'': 0, 's': 0, 'sec': 0, 'ms': -3, 'us': -6, 'ns': -9, 'nsec': -9}  # of ten, of seconds
SHOWN = 60  # characters of a line in a message


class UnorderedPose(IdemError):
    """Rows whose names say another order, which cannot be told."""


def rows_of_poses(content):
    """Return [(number, words)] of the lines of a text that are poses, and whether names say how.

    Where a header, or a comment before the rows, names a time, a position and a quaternion, the
    words are those of a TUM line, t in seconds; without a time t is 0. Comments and the header
    are left out.

    Args:
        content: bytes.

    Raises:
        UnorderedPose: a comment says that quaternions begin with w, and not where all else is.
        UnreadableCloud: it is no text.
    """
    lines, comments = numbered_lines(text_of(content))
    rows = [(number, words_of(line)) for number, line in lines]
    if not rows:
        return rows, False
    if not any(map(NUMBER.match, rows[0][1])) and (order := _order(lines[0][1])):
        return [_ordered(row, *order) for row in rows[1:]], True
    for number, comment in reversed(comments):
        if number < rows[0][0] and (order := _order(comment.lstrip('#/%! '))):
            return [_ordered(row, *order) for row in rows], True
        if W_FIRST.search(comment):
            raise UnorderedPose(
                f'line {number} ({comment[:SHOWN]!r}) has qw before qx; the order must be '
                'qx qy qz qw'
            )
    return rows, False


def words_of(line):
    """Split a line at blanks, or at commas or semicolons with blanks about them.

    Where blanks or semicolons part what a comma would part once more, it is the decimal sign.
    Brackets, as numpy prints them, are blanks.
    """
    bare = BRACKETS.sub(' ', line).strip(' \t,;')
    words = re.split(r'[ \t]*;[ \t]*|[ \t]+', bare)
    if len(words) > 1 and ',' in bare and all(map(DECIMAL.match, words)):
        return [word.replace(',', '.') for word in words]
    return [word.strip() for word in re.split(r'[ \t]*[,;][ \t]*|[ \t]+', bare)]


def as_number(word):
    """Return the number that a word is.

    Raises:
        ValueError: it is none; Python's own float takes 1_5 for 15.
    """
    if not NUMBER.match(word):
        raise ValueError(f'{word[:SHOWN]!r} is no number')
    return float(word)


def _order(header):
    """Return (where each of `ORDER` is, None without a time; the power of ten of the time)."""
    names = re.split(r'[,;\t]', header) if re.search(r'[,;\t]', header) else _words(header)
    roles = [_role(name) for name in names]
    places = {role: roles.index(role) for role in ORDER if roles.count(role) == 1}
    if any(role not in places for role in ORDER[1:]) or roles.count('t') > 1:
        return None
    at = places.get('t')
    unit = UNIT.search(names[at].lower()) if at is not None else None
    power = POWERS.get(unit[1] if unit else '')
    return None if power is None else ([places.get(role) for role in ORDER], power, len(names))


def _words(header):
    return re.sub(r'\s+([\[(])', r'\1', header).split()


def _role(name):
    """Return what of `ORDER` a name means; None: none."""
    tokens = TOKEN.findall(UNIT.sub('', name.lower()))
    last, rest = tokens[-1] if tokens else '', set(tokens[:-1])
    if last in ORDER[4:] or (last in ('x', 'y', 'z', 'w') and rest & ROTATIONS):
        return f'q{last[-1]}'
    if last in ('x', 'y', 'z') and (not rest or rest & POSITIONS):
        return last
    if last in ('tx', 'ty', 'tz', 'px', 'py', 'pz') and not rest:
        return last[-1]
    return 't' if last in TIMES else None


def _ordered(row, places, power, width):
    number, words = row
    if len(words) != width:
        raise UnorderedPose(
            f'line {number} holds {len(words)} words, and its header names {width}'
        )
    found = ['0' if at is None else words[at] for at in places]
    with suppress(InvalidOperation):  # whoever reads the time says that it is none
        found[0] = str(Decimal(found[0]).scaleb(power)) if power else found[0]
    return number, found
