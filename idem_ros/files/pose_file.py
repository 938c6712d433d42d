"""Poses as text: one or several, as matrices, TUM lines, or the vertices of a .g2o."""

import logging
from pathlib import Path

import numpy as np

from idem_ros.core.exceptions import IdemError, InvalidTransform
from idem_ros.core.geometry.se3 import checked_transform, inverse
from idem_ros.files.atomic_file import replacing
from idem_ros.files.pose_rows import TUM_NUMBERS, UnorderedPose, as_number, rows_of_poses
from idem_ros.files.unreadable import UnreadableCloud, refuse_special
from idem_ros.messages.transform_message import matrix_from, translation_and_quaternion

EXPECTED = (
    'a 4x4 matrix or its first three rows, in rows or in one line, or one line t x y z qx qy qz qw'
)
LARGEST = 1 << 20  # [bytes]; more is no pose
HINTS = {
    7: '; a TUM line begins with a time: put 0 before it',
    6: '; angles are not read: a quaternion or a matrix must say the rotation',
}
SHOWN = 60  # characters of a line in a message
UNIT_LENGTH = 0.01  # of a quaternion: how far off it is by few digits
ABOUT_X = 0.96  # of the x axis that a rotation about x, or nearly, keeps of itself

logger = logging.getLogger(__name__)

SUFFIXES = {'.g2o': 'g2o', '.mat': 'matrix', '.tum': 'tum', '.txt': 'tum'}
LARGEST_LIST = 1 << 28  # [bytes]; a million poses have less
VERTEX, EDGE = 'VERTEX_SE3:QUAT', 'EDGE_SE3:QUAT'
EXPECTED_LIST = (
    'one pose a cloud: lines t x y z qx qy qz qw, lines of 12 or 16 numbers, 4x4 matrices, or '
    f'{VERTEX} lines'
)
LAST_ROW = (0.0, 0.0, 0.0, 1.0)


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
        numbers = [_numbers(row) for row in rows_of_poses(content)[0]]
        pose = checked_transform(_matrix(numbers), 'the matrix')
        if len(numbers[0]) == TUM_NUMBERS:
            note_half_turns(path, pose[None])
        return pose
    except OSError as error:
        raise UnreadablePose(f'{path} cannot be read: {error.strerror or error}') from error
    except (UnreadablePose, UnorderedPose, UnreadableCloud) as error:
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


def note_half_turns(path, poses):
    """Say where quaternions look as if w came first: each turns about x, and one by far.

    poses: (N, 4, 4), of quaternions; that of a vehicle, with w first, is (cos, 0, 0, sin).
    """
    poses = np.asarray(poses)
    cosines = (poses[:, 1, 1] + poses[:, 2, 2]) / 2.0
    if (poses[:, 0, 0] > ABOUT_X).all() and (cosines < 0.0).any():
        logger.warning(
            '%s: its quaternions are read as turns about x by more than 90 deg; where w comes '
            'first in it, it must come last: 0 0 0 1 is no turn',
            path,
        )


def quaternion_pose(numbers):
    """Return the (4, 4) pose of x y z qx qy qz qw.

    Raises:
        InvalidTransform: it is not finite, or the quaternion has not the length 1 of a rotation.
    """
    pose = matrix_from(numbers[:3], numbers[3:])
    length = float(np.linalg.norm(numbers[3:]))
    if abs(length - 1.0) > UNIT_LENGTH:
        raise InvalidTransform(
            f'the quaternion (x, y, z, w) is {numbers[3:]}, of length {length:.3g}; it must have '
            'length 1'
        )
    return pose


def _numbers(row):
    line, words = row
    try:
        return [as_number(word) for word in words]
    except ValueError as error:
        raise UnreadablePose(f'line {line} is {" ".join(words)[:SHOWN]!r}') from error


def _matrix(rows):
    lengths = [len(row) for row in rows]
    if lengths == [TUM_NUMBERS]:
        return quaternion_pose(rows[0][1:])
    if lengths in ([12], [16], [4] * 3, [4] * 4):
        matrix = np.concatenate([np.ravel(row) for row in rows]).reshape(-1, 4)
        return matrix if len(matrix) == 4 else np.vstack([matrix, (0.0, 0.0, 0.0, 1.0)])
    shown = f'lines of {", ".join(map(str, lengths[:5]))} numbers' if lengths else 'no number'
    hint = HINTS.get(lengths[0], '') if len(lengths) == 1 else ''
    raise UnreadablePose(f'it holds {shown}{hint}')


def read_poses(path, count):
    """Return (count, 4, 4) poses of a file: TUM lines, matrices in rows or lines, or a .g2o.

    Raises:
        UnreadablePose: no such file, other content, or another number of poses.
        InvalidTransform: numbers that are no rigid transform; it says which pose.
    """
    path = Path(path)
    refuse_special(path, UnreadablePose)
    try:
        with path.open('rb') as stream:
            content = stream.read(LARGEST_LIST)
        lines, _ = rows_of_poses(content)
        is_graph = path.suffix.lower() == '.g2o' or any(words[0] == VERTEX for _, words in lines)
        found = _vertices(lines) if is_graph else _matrices(lines)
        poses = [checked_transform(T, f'pose {k}') for k, T in enumerate(found)]
        if poses and not is_graph and len(lines) == len(poses) and len(lines[0][1]) == TUM_NUMBERS:
            note_half_turns(path, poses)
    except OSError as error:
        raise UnreadablePose(f'{path} cannot be read: {error.strerror or error}') from error
    except UnreadableCloud as error:
        raise UnreadablePose(
            f'{path} holds no poses; it must hold {EXPECTED_LIST}: {error}'
        ) from error
    except IdemError as error:
        raise type(error)(f'{path}: {error}') from error
    if len(poses) != count:
        raise UnreadablePose(
            f'{path} holds {len(poses)} poses for {count} clouds; it must hold {EXPECTED_LIST}'
        )
    return np.array(poses)


def write_poses(path, poses, edges=()):
    """Write (K, 4, 4) poses: .g2o with edges, .mat as 4x4 matrices, .tum and .txt as TUM lines.

    Args:
        path: its suffix, one of `SUFFIXES`, says as what.
        poses: (K, 4, 4); the stamp of a TUM line is the cloud's number.
        edges: (i, j, covariance (6, 6) of j's pose in i) of each edge of a .g2o, x y z rx ry rz,
            in the axes of i about the origin of j; a fourth is that pose, (4, 4), where it is
            another than the poses have.
    """
    kind = SUFFIXES[Path(path).suffix.lower()]
    if kind == 'tum':
        write_tum(path, [k * 10**9 for k in range(len(poses))], poses)
        return
    with replacing(path) as temporary, temporary.open('w') as stream:
        if kind == 'matrix':
            for pose in poses:
                np.savetxt(stream, pose)
                stream.write('\n')
        else:
            stream.writelines(f'{VERTEX} {k} {_words(T)}\n' for k, T in enumerate(poses))
            stream.writelines(_edge_line(poses, *edge) for edge in edges)


def _edge_line(poses, i, j, covariance, T_i_j=None):
    """Return an edge: the information is in the axes of j, as g2o has it, of a rotation vector."""
    T = inverse(poses[i]) @ poses[j] if T_i_j is None else T_i_j
    turn = np.kron(np.eye(2), T[:3, :3].T)
    information = np.linalg.inv(turn @ covariance @ turn.T)
    upper = ' '.join(f'{number:.9g}' for number in information[np.triu_indices(6)])
    return f'{EDGE} {i} {j} {_words(T)} {upper}\n'


def _words(T):
    translation, quaternion = translation_and_quaternion(T)
    return ' '.join(f'{number:.12f}' for number in (*translation, *quaternion))


def _vertices(lines):
    """Return the poses of the vertices of a graph, by their numbers."""
    found = {}
    for number, words in lines:
        if words[0] == VERTEX:
            values = _numbers_in(number, words[1:], (8,))
            found[values[0]] = quaternion_pose(values[1:])
    return [found[key] for key in sorted(found)]


def _matrices(lines):
    rows = [_numbers_in(number, words, (4, 7, 8, 12, 16)) for number, words in lines]
    if rows and len(rows[0]) == 4:
        return _of_rows(lines, rows)
    return [_of_line(number, row) for (number, _), row in zip(lines, rows, strict=True)]


def _of_line(number, row):
    if len(row) in (7, 8):
        if len(row) == 7:
            raise UnreadablePose(
                f'line {number} has 7 numbers; a TUM line begins with a time: put 0 before it'
            )
        try:
            return quaternion_pose(row[1:])
        except InvalidTransform as error:
            raise InvalidTransform(f'line {number}: {error}') from error
    if len(row) == 4:
        raise UnreadablePose(f'line {number} has 4 numbers among poses that fill a line each')
    return np.reshape([*row, *LAST_ROW][:16], (4, 4))


def _of_rows(lines, rows):
    """Return matrices of four rows each; all rows have four numbers."""
    odd = next((n for (n, _), row in zip(lines, rows, strict=True) if len(row) != 4), None)
    if odd is not None:
        raise UnreadablePose(f'line {odd} has not 4 numbers, as the rows before it have')
    if len(rows) % 4:
        raise UnreadablePose(f'it holds {len(rows)} rows of 4 numbers; a pose is a 4x4 matrix')
    return list(np.reshape(rows, (-1, 4, 4)))


def _numbers_in(number, words, lengths):
    try:
        values = [as_number(word) for word in words]
    except ValueError as error:
        raise UnreadablePose(f'line {number} is {" ".join(words)[:60]!r}') from error
    if len(values) not in lengths:
        raise UnreadablePose(
            f'line {number} has {len(values)} numbers; there must be {EXPECTED_LIST}'
        )
    return values
