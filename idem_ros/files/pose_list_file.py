"""Poses of several clouds in one file, in their order: TUM lines, matrices, or .g2o."""

from pathlib import Path

import numpy as np

from idem_ros.core.exceptions import IdemError, InvalidTransform
from idem_ros.core.geometry.se3 import checked_transform, inverse
from idem_ros.files.atomic_file import replacing
from idem_ros.files.pose_file import UnreadablePose, lines_of_poses, words_of, write_tum
from idem_ros.files.unreadable import UnreadableCloud, refuse_special
from idem_ros.messages.transform_message import matrix_from, translation_and_quaternion

SUFFIXES = {'.g2o': 'g2o', '.mat': 'matrix', '.tum': 'tum', '.txt': 'tum'}
LARGEST = 1 << 28  # [bytes]; a million poses have less
VERTEX, EDGE = 'VERTEX_SE3:QUAT', 'EDGE_SE3:QUAT'
EXPECTED = (
    'one pose a cloud: lines t x y z qx qy qz qw, lines of 12 or 16 numbers, 4x4 matrices, or '
    f'{VERTEX} lines'
)
LAST_ROW = (0.0, 0.0, 0.0, 1.0)


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
            content = stream.read(LARGEST)
        lines = [(number, words_of(line)) for number, line in lines_of_poses(content)]
        is_graph = path.suffix.lower() == '.g2o' or any(words[0] == VERTEX for _, words in lines)
        found = _vertices(lines) if is_graph else _matrices(lines)
        poses = [checked_transform(T, f'pose {k}') for k, T in enumerate(found)]
    except OSError as error:
        raise UnreadablePose(f'{path} cannot be read: {error.strerror or error}') from error
    except UnreadableCloud as error:
        raise UnreadablePose(f'{path} holds no poses; it must hold {EXPECTED}: {error}') from error
    except IdemError as error:
        raise type(error)(f'{path}: {error}') from error
    if len(poses) != count:
        raise UnreadablePose(
            f'{path} holds {len(poses)} poses for {count} clouds; it must hold {EXPECTED}'
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
            values = _numbers(number, words[1:], (8,))
            found[values[0]] = matrix_from(values[1:4], values[4:])
    return [found[key] for key in sorted(found)]


def _matrices(lines):
    rows = [_numbers(number, words, (4, 7, 8, 12, 16)) for number, words in lines]
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
            return matrix_from(row[1:4], row[4:])
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


def _numbers(number, words, lengths):
    try:
        values = [float(word) for word in words]
    except ValueError as error:
        raise UnreadablePose(f'line {number} is {" ".join(words)[:60]!r}') from error
    if len(values) not in lengths:
        raise UnreadablePose(f'line {number} has {len(values)} numbers; there must be {EXPECTED}')
    return values
