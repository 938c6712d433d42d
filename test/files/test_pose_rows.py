"""Poses in the order that names say, and as programs print them."""

import numpy as np
import pytest
from clouds import motion
from scipy.spatial.transform import Rotation

from idem_ros.core import IdemError
from idem_ros.files.pose_file import UnreadablePose, read_pose, read_poses
from idem_ros.files.trajectory_file import UnreadableTrajectory, read_trajectory

EUROC = '#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], '
EUROC += 'q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []'
ROS = ','.join(f'field.pose.position.{axis}' for axis in 'xyz')
ROS += ',' + ','.join(f'field.pose.orientation.{axis}' for axis in 'xyzw')


@pytest.fixture
def poses(rng):
    return np.array([motion(rng, 40.0, 9.0) for _ in range(4)])


def table(poses, header, order='xyzw', between=',', unit=1, after=''):
    """Text of a header and a row a pose, a tenth of a second apart."""
    rows = [header]
    for k, pose in enumerate(poses):
        x, y, z, w = map(repr, Rotation.from_matrix(pose[:3, :3]).as_quat().tolist())
        quaternion = [x, y, z, w] if order == 'xyzw' else [w, x, y, z]
        stamp = str((1_500_000_000_000_000_000 + k * 10**8) // unit)
        stamp = f'{stamp[:-9]}.{stamp[-9:]}' if unit == 1 and after != 'ns' else stamp
        rows.append(between.join([stamp, *map(repr, pose[:3, 3].tolist()), *quaternion]))
    return '\n'.join(rows) + '\n'


@pytest.mark.parametrize(
    ('header', 'order'),
    [
        ('stamp,x,y,z,qx,qy,qz,qw', 'xyzw'),
        ('timestamp,tx,ty,tz,qx,qy,qz,qw', 'xyzw'),
        ('"time","x","y","z","qw","qx","qy","qz"', 'wxyz'),
        ('t [s], pos_x [m], pos_y [m], pos_z [m], quat_w, quat_x, quat_y, quat_z', 'wxyz'),
        ('# time x y z qw qx qy qz', 'wxyz'),
        (f'%time,{ROS}', 'xyzw'),
    ],
)
@pytest.mark.parametrize('name', ['a.csv', 'a.txt'])
def test_columns_of_a_trajectory_are_taken_by_their_names(tmp_path, poses, header, order, name):
    (tmp_path / name).write_text(table(poses, header, order))
    read = read_trajectory(tmp_path / name)
    np.testing.assert_allclose(read.poses, poses, atol=1e-12)
    assert (np.diff(read.stamps) == 10**8).all()


@pytest.mark.parametrize(('unit', 'divisor'), [('ns', 1), ('us', 10**3), ('ms', 10**6)])
def test_the_unit_of_a_time_is_that_of_its_name(tmp_path, poses, unit, divisor):
    header = EUROC.replace('[ns]', f'[{unit}]')
    (tmp_path / 'a.csv').write_text(table(poses, header, 'wxyz', unit=divisor, after='ns'))
    read = read_trajectory(tmp_path / 'a.csv')
    np.testing.assert_allclose(read.poses, poses, atol=1e-12)
    assert read.stamps.tolist() == [1_500_000_000_000_000_000 + k * 10**8 for k in range(4)]


def test_columns_of_other_things_are_passed_over(tmp_path, poses):
    """As the ground truth of EuRoC: velocities and biases follow."""
    others = ''.join(f', v_RS_R_{axis} [m s^-1], b_w_RS_S_{axis} [rad s^-1]' for axis in 'xyz')
    text = table(poses, EUROC, 'wxyz', after='ns').replace('\n', ',1,2,3,4,5,6\n')
    text = text.replace(EUROC + ',1,2,3,4,5,6', EUROC + others)
    (tmp_path / 'a.csv').write_text(text)
    np.testing.assert_allclose(read_trajectory(tmp_path / 'a.csv').poses, poses, atol=1e-12)


@pytest.mark.parametrize(
    'header',
    [
        'a,b,c,d,e,f,g,h',
        'stamp,x,y,z,roll,pitch,yaw,w',
        'stamp,x,y,z,x,qy,qz,qw',
        'stamp,time,x,y,qx,qy,qz,qw',
        'stamp [min],x,y,z,qx,qy,qz,qw',
    ],
)
def test_a_csv_whose_names_are_no_pose_is_refused(tmp_path, poses, header):
    (tmp_path / 'a.csv').write_text(table(poses, header))
    with pytest.raises(UnreadableTrajectory, match='must begin with the line stamp,x,y,z'):
        read_trajectory(tmp_path / 'a.csv')


def test_a_row_that_is_shorter_than_its_header_is_named(tmp_path, poses):
    (tmp_path / 'a.csv').write_text(table(poses, 'stamp,x,y,z,qw,qx,qy,qz', 'wxyz') + '1,2,3\n')
    with pytest.raises(UnreadableTrajectory, match='line 6 holds 3 words, and its header names 8'):
        read_trajectory(tmp_path / 'a.csv')


def test_a_time_beyond_seconds_is_told_how_to_say_its_unit(tmp_path, poses):
    (tmp_path / 'a.csv').write_text(table(poses, 'stamp,x,y,z,qx,qy,qz,qw', after='ns'))
    with pytest.raises(UnreadableTrajectory, match=r'as timestamp \[ns\]'):
        read_trajectory(tmp_path / 'a.csv')


def test_a_header_names_the_numbers_of_one_pose_and_of_many(tmp_path, poses):
    header = 'x,y,z,qw,qx,qy,qz'
    rows = table(poses, header, 'wxyz').splitlines()
    text = '\n'.join([header, *(row.partition(',')[2] for row in rows[1:])])
    (tmp_path / 'all.csv').write_text(text)
    (tmp_path / 'one.csv').write_text('\n'.join(text.splitlines()[:2]))
    np.testing.assert_allclose(read_poses(tmp_path / 'all.csv', 4), poses, atol=1e-12)
    np.testing.assert_allclose(read_pose(tmp_path / 'one.csv'), poses[0], atol=1e-12)


@pytest.mark.parametrize('show', [str, repr, lambda T: str(T.tolist())])
@pytest.mark.parametrize('rows', [3, 4])
def test_a_matrix_as_numpy_prints_it_is_read(tmp_path, poses, show, rows):
    (tmp_path / 'a.txt').write_text(show(poses[0][:rows]))
    np.testing.assert_allclose(read_pose(tmp_path / 'a.txt'), poses[0], atol=1e-7)


def test_a_matrix_as_matlab_writes_it_is_read(tmp_path, poses):
    rows = '; '.join(' '.join(map(repr, row)) for row in poses[0].tolist())
    (tmp_path / 'a.txt').write_text(f'[{rows}]')
    np.testing.assert_allclose(read_pose(tmp_path / 'a.txt'), poses[0], atol=1e-12)


def test_lines_of_sixteen_numbers_are_a_trajectory(tmp_path, poses):
    np.savetxt(tmp_path / 'a.txt', poses.reshape(-1, 16))
    read = read_trajectory(tmp_path / 'a.txt')
    np.testing.assert_allclose(read.poses, poses, atol=1e-12)
    assert read.stamps is None


@pytest.mark.parametrize('first', ['x', 'w'])
def test_quaternions_that_look_as_if_w_came_first_are_doubted(tmp_path, first, caplog):
    yaw = Rotation.from_euler('z', [[0.0], [40.0], [80.0], [130.0]], degrees=True).as_quat()
    numbers = np.roll(yaw, 1, axis=1) if first == 'w' else yaw
    table = np.c_[np.arange(4.0), np.zeros((4, 3)), numbers]
    np.savetxt(tmp_path / 'all.tum', table, '%.9f')
    np.savetxt(tmp_path / 'one.tum', table[:1], '%.9f')
    for read in (read_trajectory, lambda path: read_poses(path, 4)):
        caplog.clear()
        read(tmp_path / 'all.tum')
        assert ('where w comes first in it, it must come last' in caplog.text) == (first == 'w')
    caplog.clear()
    read_pose(tmp_path / 'one.tum')
    assert ('where w comes first' in caplog.text) == (first == 'w')


def test_a_quaternion_of_another_length_is_refused_everywhere(tmp_path):
    """As where a time or an angle stands among the four."""
    (tmp_path / 'a.txt').write_text('1 2 3 0 0 0 1 12.5\n')
    (tmp_path / 'a.g2o').write_text('VERTEX_SE3:QUAT 0 1 2 3 0 0 1 12.5\n')
    for read in (
        lambda: read_pose(tmp_path / 'a.txt'),
        lambda: read_poses(tmp_path / 'a.txt', 1),
        lambda: read_trajectory(tmp_path / 'a.txt'),
        lambda: read_poses(tmp_path / 'a.g2o', 1),
    ):
        with pytest.raises(IdemError, match='of length 12.5; it must have length 1'):
            read()


def test_a_pose_of_angles_is_refused(tmp_path):
    (tmp_path / 'a.txt').write_text('1.0 2.0 3.0 0.1 0.2 0.3\n')
    with pytest.raises(UnreadablePose, match='lines of 6 numbers; angles are not read'):
        read_pose(tmp_path / 'a.txt')
