"""Where the sensors are looked for: by a URDF, a YAML, a list of poses, or tf_static."""

from pathlib import Path

import numpy as np

from idem_ros.calibration.frame_tree import FrameTree, UnknownStart, bare
from idem_ros.calibration.urdf import read_urdf, transform_of
from idem_ros.core.exceptions import IdemError
from idem_ros.core.geometry.se3 import checked_transform
from idem_ros.files.pose_file import read_poses
from idem_ros.files.structured_text import read_yaml
from idem_ros.messages.transform_message import matrix_from, matrix_of

RIG = 'rig'  # the frame of poses that name none
ROTATIONS = {'rpy': 3, 'rpy_deg': 3, 'quaternion': 4}
SAID = {'verdict', 'p_aligned', 'reason', 'by', 'sigma', 'covariance', 'spread', 'instants'}
EXPECTED = (
    'sensors: {NAME: {parent: FRAME, xyz: [m], and one of rpy: [rad], rpy_deg: [deg], quaternion: '
    '[x, y, z, w]; or matrix: 4x4}}'
)


def read_starts(path, names):
    """Return the `FrameTree` of a file, by its suffix.

    Args:
        path: .urdf or .xml; .yaml, .yml or .json; else poses, one a sensor in their order, as
            `read_poses` takes them.
        names: of the sensors.

    Raises:
        UnknownStart, UnreadableText, UnreadablePose, InvalidTransform: it is none of these.
    """
    suffix = Path(path).suffix.lower()
    if suffix == '.xacro':
        raise UnknownStart(f'{path} is a xacro: give what it becomes, xacro FILE > robot.urdf')
    if suffix in ('.urdf', '.xml'):
        return read_urdf(path)
    if suffix in ('.yaml', '.yml', '.json'):
        return _of_yaml(path, read_yaml(path))
    poses = read_poses(path, len(names))
    return FrameTree(str(path), {n: (RIG, T) for n, T in zip(names, poses, strict=True)})


def tree_of_messages(source, messages):
    """Return the `FrameTree` of TFMessages of tf_static, and what could not be read."""
    edges, flaws = {}, []
    for message in messages:
        for each in message.transforms:
            child, parent = bare(each.child_frame_id), bare(each.header.frame_id)
            try:
                if child != parent:
                    edges[child] = parent, matrix_of(each)
            except IdemError as error:
                flaws.append(f'{child!r} in {source}: {error}')
    return FrameTree(source, edges), flaws


def starts_of(tree, names):
    """Return (S, 4, 4) of the sensors in the frame of the first.

    Raises:
        UnknownStart: it says of which nothing is known.
    """
    return np.array([tree.pose(names[0], name) for name in names])


def no_starts(names):
    """Return the `FrameTree` of sensors that are all looked for at one place."""
    return FrameTree('no start', {name: (RIG, np.eye(4)) for name in names})


def _of_yaml(path, content):
    sensors = content.get('sensors') if isinstance(content, dict) else None
    if not isinstance(sensors, dict) or not sensors:
        raise UnknownStart(f'{path} says no starts; it must hold {EXPECTED}')
    common = content.get('frame') or RIG
    edges, covariances = {}, {}
    for name, said in sensors.items():
        parent = said.get('parent', common) if isinstance(said, dict) else common
        pose = _pose(path, name, said)
        if bare(parent) != bare(name):
            edges[name] = str(parent), pose
            if 'covariance' in said:
                covariances[name] = _covariance(path, name, said['covariance'])
        elif not np.allclose(pose, np.eye(4)):
            raise UnknownStart(f'{path}: {name} is its own parent, and not at its own place')
    return FrameTree(str(path), edges, covariances)


def _covariance(path, name, said):
    try:
        matrix = np.array(said, dtype=np.float64)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    is_one = matrix.shape == (6, 6) and np.isfinite(matrix).all()
    if not is_one or np.linalg.eigvalsh(matrix)[0] < 0.0:
        raise UnknownStart(f'{path}: the covariance of {name} is none: 6x6, variances from 0')
    return matrix


def _pose(path, name, said):
    if not isinstance(said, dict):
        raise UnknownStart(f'{path}: {name} is {said!r}; it must be a mapping: {EXPECTED}')
    unknown = [key for key in said if key not in {*ROTATIONS, *SAID, 'parent', 'xyz', 'matrix'}]
    if unknown:
        raise UnknownStart(f'{path}: {name} has {unknown[0]!r}, which means nothing: {EXPECTED}')
    if 'matrix' in said:
        if set(said) & {*ROTATIONS, 'xyz'}:
            raise UnknownStart(f'{path}: {name} has a matrix and another pose; give one')
        return checked_transform(said['matrix'], f'{path}: the matrix of {name}')
    rotations = [key for key in ROTATIONS if key in said]
    if len(rotations) > 1:
        raise UnknownStart(f'{path}: {name} has {" and ".join(rotations)}; give one of them')
    xyz = _numbers(path, name, said, 'xyz', 3)
    if not rotations:
        return transform_of(xyz, (0.0, 0.0, 0.0))
    key = rotations[0]
    numbers = _numbers(path, name, said, key, ROTATIONS[key])
    if key == 'quaternion':
        return matrix_from(xyz, numbers)
    return transform_of(xyz, np.radians(numbers) if key == 'rpy_deg' else numbers)


def _numbers(path, name, said, key, count):
    values = said.get(key, [0.0] * count)
    are_numbers = isinstance(values, list) and all(
        isinstance(each, int | float) and not isinstance(each, bool) for each in values
    )
    if not are_numbers or len(values) != count or not np.isfinite(values).all():
        raise UnknownStart(f'{path}: {key} of {name} is {values!r}; it must be {count} numbers')
    return [float(each) for each in values]
