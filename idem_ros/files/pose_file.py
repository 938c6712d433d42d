"""Poses as text: a 4x4 or 3x4 matrix, or TUM lines of stamp, translation and quaternion."""

import re
from pathlib import Path

import numpy as np

from idem_ros.core.exceptions import IdemError
from idem_ros.core.geometry.se3 import checked_transform
from idem_ros.files.atomic_file import replacing
from idem_ros.files.text_lines import numbered_lines, text_of
from idem_ros.files.unreadable import UnreadableCloud, refuse_special
from idem_ros.messages.transform_message import matrix_from, translation_and_quaternion

EXPECTED = (
    'a 4x4 matrix or its first three rows, in rows or in one line, or one line t x y z qx qy qz qw'
)
LARGEST = 1 << 20  # [bytes]; more is no pose
DECIMAL = re.compile(r'[+-]?\d+(,\d+)?([eE][+-]?\d+)?$')
W_FIRST = re.compile(r'\bq\w*w\b.*\bq\w*x\b', re.IGNORECASE)  # as EuRoC has it
SHOWN = 60  # characters of a line in a message


class UnreadablePose(IdemError):
    """A file that holds no pose that can be read."""


def read_pose(path):
    """Read one rigid transform from a text file; blanks, commas or semicolons part its numbers.

    Args:
        path: a 4x4 matrix or its first three rows, as rows or in one line, or one TUM line
            `t x y z qx qy qz qw`.

    Returns:
        (4, 4) float64, its rotation made exactly orthonormal.

    Raises:
        UnreadablePose: no such file, or other content.
        InvalidTransform: numbers that are no rigid transform.
    """
    path = Path(path)
    refuse_special(path, UnreadablePose)
    try:
        with path.open('rb') as stream:
            content = stream.read(LARGEST)
        numbers = [_numbers(line) for line in lines_of_poses(content)]
        return checked_transform(_matrix(numbers), 'the matrix')
    except OSError as error:
        raise UnreadablePose(f'{path} cannot be read: {error.strerror or error}') from error
    except (UnreadablePose, UnreadableCloud) as error:
        raise UnreadablePose(f'{path} is no pose; it must hold {EXPECTED}: {error}') from error
    except IdemError as error:
        raise type(error)(f'{path}: {error}') from error


def write_pose(path, transform):
    """Write a (4, 4) transform as four rows of numbers, every digit kept."""
    with replacing(path) as temporary:
        np.savetxt(temporary, transform)


def write_tum(path, stamps, transforms):
    """Write (4, 4) transforms as TUM lines; stamps in nanoseconds."""
    with replacing(path) as temporary, temporary.open('w') as stream:
        stream.writelines(map(tum_line, stamps, transforms))


def tum_line(stamp, transform):
    """Return the line `t x y z qx qy qz qw` of a (4, 4) transform; `stamp` in nanoseconds."""
    seconds, nanoseconds = divmod(int(stamp), 10**9)
    translation, quaternion = translation_and_quaternion(transform)
    numbers = ' '.join(f'{number:.12f}' for number in (*translation, *quaternion))
    return f'{seconds}.{nanoseconds:09d} {numbers}\n'


def lines_of_poses(content):
    """Return (number, line) of each line of a text, in bytes, that is no comment.

    Raises:
        UnreadablePose: a comment says that quaternions begin with w.
        UnreadableCloud: it is no text.
    """
    lines, comments = numbered_lines(text_of(content))
    for number, comment in comments:
        if W_FIRST.search(comment):
            raise UnreadablePose(
                f'line {number} ({comment[:SHOWN]!r}) has qw before qx; the order must be '
                'qx qy qz qw'
            )
    return lines


def words_of(line):
    """Split a line at blanks, or at commas or semicolons with blanks about them.

    Where blanks or semicolons part what a comma would part once more, it is the decimal sign.
    """
    bare = line.strip(' \t,;')
    words = re.split(r'[ \t]*;[ \t]*|[ \t]+', bare)
    if len(words) > 1 and ',' in bare and all(map(DECIMAL.match, words)):
        return [word.replace(',', '.') for word in words]
    return [word.strip() for word in re.split(r'[ \t]*[,;][ \t]*|[ \t]+', bare)]


def _numbers(row):
    number, line = row
    try:
        return [float(word) for word in words_of(line)]
    except ValueError as error:
        raise UnreadablePose(f'line {number} is {line[:SHOWN]!r}') from error


def _matrix(rows):
    lengths = [len(row) for row in rows]
    if lengths == [8]:
        return matrix_from(rows[0][1:4], rows[0][4:])
    if lengths in ([12], [16], [4] * 3, [4] * 4):
        matrix = np.concatenate([np.ravel(row) for row in rows]).reshape(-1, 4)
        return matrix if len(matrix) == 4 else np.vstack([matrix, (0.0, 0.0, 0.0, 1.0)])
    shown = f'lines of {", ".join(map(str, lengths[:5]))} numbers' if lengths else 'no number'
    hint = '; a TUM line begins with a time: put 0 before it' if lengths == [7] else ''
    raise UnreadablePose(f'it holds {shown}{hint}')
