"""Poses as text: a 4x4 matrix, or TUM lines of stamp, translation and quaternion."""

import warnings
from pathlib import Path

import numpy as np

from idem_ros.atomic_file import replacing
from idem_ros.core.exceptions import IdemError
from idem_ros.core.se3 import checked_transform
from idem_ros.transform_message import matrix_from, translation_and_quaternion

EXPECTED = 'four rows of four numbers, or one line t x y z qx qy qz qw'


class UnreadablePose(IdemError):
    """A file that holds no pose that can be read."""


def read_pose(path):
    """Read one rigid transform from a text file.

    Args:
        path: a 4x4 matrix as `np.savetxt` writes it, or one TUM line `t x y z qx qy qz qw`.

    Returns:
        (4, 4) float64, its rotation made exactly orthonormal.

    Raises:
        UnreadablePose: no such file, or other content.
        InvalidTransform: numbers that are no rigid transform.
    """
    path = Path(path)
    try:
        with path.open() as stream, warnings.catch_warnings():
            warnings.simplefilter('ignore')  # an empty file is reported below, in one line
            numbers = np.loadtxt(stream, ndmin=2)
    except OSError as error:
        raise UnreadablePose(f'{path} cannot be read: {error.strerror or error}') from error
    except ValueError as error:
        reason = ' '.join(str(error).split())
        raise UnreadablePose(f'{path} is no pose; it must hold {EXPECTED}: {reason}') from error
    try:
        return checked_transform(_matrix(numbers), 'the matrix')
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


def _matrix(numbers):
    if numbers.shape == (4, 4):
        return numbers
    if numbers.shape != (1, 8):
        raise UnreadablePose(f'it holds numbers of shape {numbers.shape}; it must hold {EXPECTED}')
    return matrix_from(numbers[0, 1:4], numbers[0, 4:])
