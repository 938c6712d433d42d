import numpy as np
import pytest
from clouds import motion
from scipy.spatial.transform import Rotation

from idem_ros.calibration.frame_tree import FrameTree, UnknownStart
from idem_ros.calibration.initial_extrinsics import read_starts, starts_of
from idem_ros.calibration.urdf import joint_text, origin_text, roll_pitch_yaw, transform_of
from idem_ros.core import IdemError

NAMES = ['top', 'left']
URDF = """<robot name="car">
  <link name="base"/><link name="roof"/><link name="top"/><link name="left"/><link name="wheel"/>
  <joint name="a" type="fixed"><parent link="base"/><child link="roof"/>
    <origin xyz="0 0 1.5" rpy="0 0 0"/></joint>
  <joint name="b" type="fixed"><parent link="roof"/><child link="top"/>
    <origin xyz="1 0 0"/></joint>
  <joint name="c" type="fixed"><parent link="base"/><child link="left"/>
    <origin xyz="1 0.5 1" rpy="0 0 1.5707963267948966"/></joint>
  <joint name="d" type="continuous"><parent link="base"/><child link="wheel"/></joint>
  <transmission name="t"><joint name="d"/></transmission>
</robot>"""


@pytest.fixture
def urdf(tmp_path):
    path = tmp_path / 'car.urdf'
    path.write_text(URDF)
    return path


def written(tmp_path, text, name='start.yaml'):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_a_urdf_tells_where_a_link_is_in_another(urdf):
    found = starts_of(read_starts(urdf, NAMES), NAMES)
    np.testing.assert_allclose(found[0], np.eye(4))
    np.testing.assert_allclose(found[1], transform_of((0, 0.5, -0.5), (0, 0, np.pi / 2)))


def test_each_sensor_stays_below_its_own_parent(urdf, rng):
    tree, moved = read_starts(urdf, NAMES), motion(rng, 20.0, 0.5)
    edges = tree.with_poses(NAMES, [np.eye(4), moved])
    assert edges['top'][0] == 'roof'
    np.testing.assert_allclose(edges['top'][1], tree.pose('roof', 'top'), atol=1e-12)
    assert edges['left'][0] == 'base'
    np.testing.assert_allclose(edges['left'][1], tree.pose('base', 'top') @ moved, atol=1e-12)


def test_a_sensor_on_another_sensor_follows_it(rng):
    T = [motion(rng, 30.0, 1.0) for _ in range(3)]
    tree = FrameTree('x', {'a': ('base', T[0]), 'b': ('base', T[1]), 'c': ('b', T[2])})
    names, poses = ['a', 'b', 'c'], [np.eye(4), motion(rng, 9.0, 1.0), motion(rng, 9.0, 1.0)]
    edges = tree.with_poses(names, poses)
    again = starts_of(FrameTree('x', edges), names)
    np.testing.assert_allclose(again, poses, atol=1e-12)
    assert [edges[name][0] for name in names] == ['base', 'base', 'b']


def test_a_reference_below_another_sensor_stays_below_it(rng):
    tree = FrameTree('x', {'b': ('a', motion(rng, 30.0, 1.0))})
    names, poses = ['b', 'a', 'c'], [np.eye(4), motion(rng, 9.0, 1.0), motion(rng, 9.0, 1.0)]
    edges = tree.with_poses(names, poses)
    assert {name: parent for name, (parent, _) in edges.items()} == {'b': 'a', 'c': 'b'}
    np.testing.assert_allclose(starts_of(FrameTree('x', edges), names), poses, atol=1e-12)


def test_a_joint_is_written_as_it_is_read(tmp_path, rng):
    T = motion(rng, 100.0, 2.0)
    text = f'<robot name="x">{joint_text("base", "left", T)}</robot>'
    tree = read_starts(written(tmp_path, text, 'x.urdf'), NAMES)
    np.testing.assert_allclose(tree.pose('base', 'left'), T, atol=1e-8)


@pytest.mark.parametrize('pitch', [90.0, -90.0, 30.0])
def test_angles_are_those_of_the_rotation_wherever_it_looks(pitch):
    T = transform_of((0, 0, 0), np.radians([20.0, pitch, 50.0]))
    again = transform_of((0, 0, 0), roll_pitch_yaw(T))
    np.testing.assert_allclose(again, T, atol=1e-9)
    assert origin_text(T).startswith('<origin xyz="0 0 0" rpy="')


@pytest.mark.parametrize(
    'rotation', ['rpy: [0.1, 0.2, 0.3]', 'rpy_deg: [10, 20, 30]', 'quaternion: [0, 0, 1, 1]']
)
def test_a_yaml_says_rotations_in_any_way(tmp_path, rotation):
    text = f'sensors:\n  top: {{}}\n  left: {{xyz: [1, 2, 3], {rotation}}}\n'
    pose = starts_of(read_starts(written(tmp_path, text), NAMES), NAMES)[1]
    np.testing.assert_allclose(pose[:3, 3], (1, 2, 3))
    wanted = {
        'rpy:': Rotation.from_euler('xyz', [0.1, 0.2, 0.3]),
        'rpy_deg:': Rotation.from_euler('xyz', [10, 20, 30], degrees=True),
        'quaternion:': Rotation.from_euler('z', 90, degrees=True),
    }[rotation.split()[0]]
    np.testing.assert_allclose(pose[:3, :3], wanted.as_matrix(), atol=1e-12)


def test_a_list_has_a_pose_a_sensor_in_their_order(tmp_path):
    path = written(tmp_path, '0 1 0 0 0 0 0 1\n1 3 0 0 0 0 0 1\n', 'poses.tum')
    found = starts_of(read_starts(path, NAMES), NAMES)
    np.testing.assert_allclose(found[1][:3, 3], (2, 0, 0))


@pytest.mark.parametrize(
    ('name', 'text', 'words'),
    [
        ('a.yaml', 'sensors: {top: {}}', "nothing of the frame 'left'; its frames: rig, top"),
        ('a.yaml', 'top: {}', 'says no starts'),
        ('a.yaml', 'sensors: {top: 3, left: {}}', 'must be a mapping'),
        ('a.yaml', 'sensors: {top: {xyz: [1, 2]}, left: {}}', 'must be 3 numbers'),
        ('a.yaml', 'sensors: {top: {rpy: [0, 0, 0], rpy_deg: [0, 0, 0]}, left: {}}', 'one of'),
        ('a.yaml', 'sensors: {top: {yaw: 3}, left: {}}', "'yaw'"),
        ('a.yaml', 'sensors: {top: {parent: left}, left: {parent: top}}', 'circle'),
        ('a.urdf', URDF.replace('child link="left"', 'child link="lidar"'), "frame 'left'"),
        ('a.urdf', URDF.replace('type="fixed"', 'type="revolute"'), 'no fixed joint'),
        ('a.urdf', URDF.replace('1 0.5 1', '1 x 1'), 'three numbers'),
        ('a.urdf', URDF[:200], 'no URDF'),
        ('a.urdf', '<sdf/>', 'begins with <sdf>'),
        ('a.urdf.xacro', URDF, 'xacro FILE'),
        ('a.txt', '0 1 0 0 0 0 0 1\n', '1 poses for 2'),
        ('none.yaml', None, 'none.yaml'),
        ('none.urdf', None, 'none.urdf'),
    ],
)
def test_what_says_no_start_is_refused_in_a_line(tmp_path, name, text, words):
    path = tmp_path / name if text is None else written(tmp_path, text, name)
    with pytest.raises(IdemError, match=words) as refused:
        starts_of(read_starts(path, NAMES), NAMES)
    assert '\n' not in str(refused.value)


def test_frames_that_nothing_connects_are_named():
    tree = FrameTree('tf', {'top': ('a', np.eye(4)), 'left': ('b', np.eye(4))})
    with pytest.raises(UnknownStart, match="does not connect 'left' with 'top'"):
        starts_of(tree, NAMES)
