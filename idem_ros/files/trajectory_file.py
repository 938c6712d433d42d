"""Trajectories as text files: TUM and CSV lines with stamps, KITTI lines without."""

from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.exceptions import IdemError
from idem_ros.core.geometry.se3 import checked_transform
from idem_ros.files.pose_file import lines_of_poses, words_of
from idem_ros.files.unreadable import refuse_special
from idem_ros.messages.transform_message import matrix_from

TUM_NUMBERS, KITTI_NUMBERS = 8, 12
CSV_HEADER = 'stamp,x,y,z,qx,qy,qz,qw'
LATEST = 2**31  # [s], the end of ROS time
EXPECTED = {
    TUM_NUMBERS: 'the eight numbers t x y z qx qy qz qw, as idem replay --tum writes them',
    KITTI_NUMBERS: 'the twelve numbers of the first three rows of a 4x4 matrix',
}


class UnreadableTrajectory(IdemError):
    """A file that holds no trajectory that can be read."""


@dataclass(frozen=True)
class Trajectory:
    """Poses of one body in one fixed frame, in the order of time."""

    poses: NDArray
    """(N, 4, 4) float64."""
    stamps: NDArray | None = None
    """(N,) int64 [ns], increasing; None: the poses are numbered from 0 (KITTI)."""

    def __len__(self):
        return len(self.poses)


def read_trajectory(path):
    """Read a trajectory file; blanks, commas or semicolons part its numbers, # begins a comment.

    Args:
        path: a .csv file whose first line is `stamp,x,y,z,qx,qy,qz,qw`; any other file holds
            TUM lines `t x y z qx qy qz qw` or KITTI lines of twelve numbers: its first line
            says which. Stamps are in seconds.

    Returns:
        `Trajectory`; KITTI's has no stamps.

    Raises:
        UnreadableTrajectory: no such file, no pose in it, or a line that is none, named by its
            number; stamps that do not increase.
    """
    path = Path(path)
    lines = lines_of_file(path)
    if path.suffix.lower() == '.csv':
        lines = _after_header(path, lines)
    if not lines:
        raise UnreadableTrajectory(
            f'{path} holds no pose; each line must hold {" or ".join(EXPECTED.values())}'
        )
    length = len(lines[0][1])
    if length not in EXPECTED or (path.suffix.lower() == '.csv' and length != TUM_NUMBERS):
        length = TUM_NUMBERS
    rows = [_checked(path, number, words, length) for number, words in lines]
    poses = np.array([pose for _, pose in rows])
    if length == KITTI_NUMBERS:
        return Trajectory(poses)
    stamps = np.array([stamp for stamp, _ in rows], dtype=np.int64)
    late = np.flatnonzero(np.diff(stamps) <= 0)
    if late.size:
        raise UnreadableTrajectory(
            f'{path}, line {lines[late[0] + 1][0]}: its stamp is not later than that of line '
            f'{lines[late[0]][0]}; stamps must increase'
        )
    return Trajectory(poses, stamps)


def lines_of_file(path, kind: type[IdemError] = UnreadableTrajectory, what='trajectory'):
    """Return (number, words) of each line of a text file that is no comment.

    Raises:
        An error of that kind: there is none, or no text in it; what: it was to be.
    """
    refuse_special(path, kind)
    try:
        lines = lines_of_poses(Path(path).read_bytes())
    except OSError as error:
        raise kind(f'{path} cannot be read: {error.strerror or error}') from error
    except IdemError as error:
        raise kind(f'{path} is no {what}: {error}') from error
    return [(number, words_of(line)) for number, line in lines]


def _after_header(path, lines):
    names = [word.strip('"').lower() for word in lines[0][1]] if lines else []
    if names != CSV_HEADER.split(','):
        raise UnreadableTrajectory(f'{path} must begin with the line {CSV_HEADER}')
    return lines[1:]


def _checked(path, number, words, length):
    try:
        if len(words) != length:
            raise UnreadableTrajectory(f'it holds {len(words)} columns')
        return (_kitti if length == KITTI_NUMBERS else _tum)(words)
    except (IdemError, ValueError, InvalidOperation) as error:
        reason = str(error) if isinstance(error, (IdemError, ValueError)) else 'its stamp'
        raise UnreadableTrajectory(
            f'{path}, line {number} is no pose ({reason}); it must hold {EXPECTED[length]}'
        ) from error


def _tum(words):
    seconds = Decimal(words[0])  # a float would round stamps of today to a quarter microsecond
    if not (seconds.is_finite() and 0 <= seconds < LATEST):
        raise UnreadableTrajectory(f'its stamp {words[0]} is none in seconds')
    numbers = [float(word) for word in words[1:]]
    return round(seconds * 10**9), matrix_from(numbers[:3], numbers[3:])


def _kitti(words):
    rows = np.reshape([float(word) for word in words], (3, 4))
    return None, checked_transform(np.vstack([rows, (0, 0, 0, 1)]), 'the matrix')
