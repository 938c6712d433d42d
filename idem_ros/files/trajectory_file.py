"""Trajectories as text files: TUM and CSV lines with stamps, KITTI lines without."""

from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.exceptions import IdemError
from idem_ros.core.geometry.se3 import checked_transform
from idem_ros.files.pose_file import note_half_turns, quaternion_pose
from idem_ros.files.pose_rows import TUM_NUMBERS, as_number, rows_of_poses
from idem_ros.files.unreadable import refuse_special

KITTI_NUMBERS, MATRIX_NUMBERS = 12, 16
CSV_HEADER = 'stamp,x,y,z,qx,qy,qz,qw'
LATEST = 2**31  # [s], the end of ROS time
EXPECTED = {
    TUM_NUMBERS: 'the eight numbers t x y z qx qy qz qw, as idem replay --tum writes them',
    KITTI_NUMBERS: 'the twelve numbers of the first three rows of a 4x4 matrix',
    MATRIX_NUMBERS: 'the sixteen numbers of a 4x4 matrix',
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
        path: TUM lines `t x y z qx qy qz qw`, or lines of the twelve (KITTI) or sixteen numbers
            of a matrix: its first line says which. Or a table whose header names a time, a
            position and a quaternion, in any order and among others; a .csv must have one.
            Stamps are in seconds, but where a header says another unit: `timestamp [ns]`.

    Returns:
        `Trajectory`; of matrices it has no stamps.

    Raises:
        UnreadableTrajectory: no such file, no pose in it, or a line that is none, named by its
            number; stamps that do not increase.
    """
    path = Path(path)
    lines, is_named = _rows_of_file(path, UnreadableTrajectory, 'trajectory')
    if path.suffix.lower() == '.csv' and not is_named:
        raise UnreadableTrajectory(
            f'{path} must begin with the line {CSV_HEADER}, or with other names of these'
        )
    if not lines:
        raise UnreadableTrajectory(
            f'{path} holds no pose; each line must hold {" or ".join(EXPECTED.values())}'
        )
    length = len(lines[0][1])
    length = length if length in EXPECTED else TUM_NUMBERS
    rows = [_checked(path, number, words, length) for number, words in lines]
    poses = np.array([pose for _, pose in rows])
    if length != TUM_NUMBERS:
        return Trajectory(poses)
    if not is_named:
        note_half_turns(path, poses)
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
    return _rows_of_file(path, kind, what)[0]


def _rows_of_file(path, kind, what):
    """Return what `lines_of_file` does, and whether a header named what they are."""
    refuse_special(path, kind)
    try:
        return rows_of_poses(Path(path).read_bytes())
    except OSError as error:
        raise kind(f'{path} cannot be read: {error.strerror or error}') from error
    except IdemError as error:
        raise kind(f'{path} is no {what}: {error}') from error


def _checked(path, number, words, length):
    try:
        if len(words) != length:
            raise UnreadableTrajectory(f'it holds {len(words)} columns')
        return (_tum if length == TUM_NUMBERS else _matrix)(words)
    except (IdemError, ValueError, InvalidOperation) as error:
        reason = str(error) if isinstance(error, (IdemError, ValueError)) else 'its stamp'
        raise UnreadableTrajectory(
            f'{path}, line {number} is no pose ({reason}); it must hold {EXPECTED[length]}'
        ) from error


def _tum(words):
    seconds = Decimal(words[0])  # a float would round stamps of today to a quarter microsecond
    if not (seconds.is_finite() and 0 <= seconds < LATEST):
        raise UnreadableTrajectory(
            f'its stamp {words[0]} is none in seconds; a header says another unit, as '
            'timestamp [ns]'
        )
    return round(seconds * 10**9), quaternion_pose([as_number(word) for word in words[1:]])


def _matrix(words):
    numbers = [as_number(word) for word in words]
    rows = np.reshape([*numbers, 0, 0, 0, 1][:MATRIX_NUMBERS], (4, 4))
    return None, checked_transform(rows, 'the matrix')
