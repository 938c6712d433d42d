"""Where the links of a robot's description are: the fixed joints of a URDF, read and written."""

from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np
from scipy.spatial.transform import Rotation

from idem_ros.calibration.frame_tree import FrameTree, UnknownStart
from idem_ros.terminal.printable import error_line

LARGEST = 1 << 24  # [bytes]
RIGID = ('fixed',)


def read_urdf(path):
    """Return the `FrameTree` of the fixed joints of a URDF.

    Raises:
        UnknownStart: it is no URDF, or a joint says no pose.
    """
    root = _root(path)
    edges, moving = {}, []
    for joint in root.iter('joint'):
        parent, child = joint.find('parent'), joint.find('child')
        if parent is None or child is None:
            continue  # of a transmission, which names joints
        names = child.get('link'), parent.get('link')
        if joint.get('type') not in RIGID:
            moving.append(names[0])
            continue
        edges[names[0]] = names[1], _origin(joint, path)
    if not edges:
        raise UnknownStart(f'{path} has no fixed joint: it says nothing of where a sensor is')
    said = f'{path} (joints that move: {", ".join(map(str, moving))})' if moving else str(path)
    return FrameTree(said, edges)


def origin_text(T):
    """Return the `<origin>` of a (4, 4) transform."""
    numbers = (*T[:3, 3], *roll_pitch_yaw(T))
    x, y, z, roll, pitch, yaw = (f'{number:.9g}' for number in numbers)
    return f'<origin xyz="{x} {y} {z}" rpy="{roll} {pitch} {yaw}"/>'


def joint_text(parent, child, T):
    """Return the fixed joint of a (4, 4) transform: child in parent."""
    name = quoteattr(f'{child}_joint')
    return (
        f'<joint name={name} type="fixed">\n  <parent link={quoteattr(parent)}/>\n'
        f'  <child link={quoteattr(child)}/>\n  {origin_text(T)}\n</joint>\n'
    )


def roll_pitch_yaw(T):
    """Return roll, pitch and yaw [rad] of a (4, 4) transform, as URDF and tf have them."""
    # about the fixed axes x, y, z; at a pitch of 90 deg roll is put to 0, which SciPy warns of
    R = T[:3, :3]
    pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    if np.hypot(R[0, 0], R[1, 0]) < 1e-9:
        return 0.0, float(pitch), float(np.arctan2(-R[0, 1], R[1, 1]))
    roll, yaw = np.arctan2(R[2, 1], R[2, 2]), np.arctan2(R[1, 0], R[0, 0])
    return float(roll), float(pitch), float(yaw)


def transform_of(xyz, rpy):
    """Return the (4, 4) transform of x y z [m] and roll pitch yaw [rad]."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler('xyz', rpy).as_matrix()
    T[:3, 3] = xyz
    return T


def _root(path):
    try:
        with open(path, 'rb') as stream:  # noqa: PTH123 (a path or text)
            content = stream.read(LARGEST + 1)
        if len(content) > LARGEST:
            raise UnknownStart(f'{path} is no URDF: it is larger than {LARGEST} bytes')
        root = ElementTree.fromstring(content)
    except OSError as error:
        raise UnknownStart(f'{path} cannot be read: {error.strerror or error}') from error
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise UnknownStart(f'{path} is no URDF: {error_line(error)}') from error
    if root.tag != 'robot':
        raise UnknownStart(f'{path} is no URDF: it begins with <{root.tag}>, not with <robot>')
    if any('xacro' in each.tag for each in root.iter()):
        raise UnknownStart(f'{path} is a xacro: give what it becomes, xacro FILE > robot.urdf')
    return root


def _origin(joint, path):
    origin = joint.find('origin')
    values = []
    for name in ('xyz', 'rpy'):
        text = '0 0 0' if origin is None else origin.get(name, '0 0 0')
        try:
            numbers = [float(word) for word in text.split()]
        except ValueError:
            numbers = []
        if len(numbers) != 3 or not np.isfinite(numbers).all():
            raise UnknownStart(
                f'{path}: joint {joint.get("name")!r} has {name}="{text}"; three numbers must be'
            )
        values.append(numbers)
    return transform_of(*values)
