import numpy as np
import pytest
from trajectories import drive, write_csv, write_kitti

from idem_ros.files.atomic_file import UnwritableFile
from idem_ros.files.pose_file import write_tum
from idem_ros.files.trajectory_file import (
    UnreadableTrajectory,
    read_trajectory,
)

POSE = '0 0 0 0 0 0 1'


@pytest.fixture
def path(rng):
    return drive(rng, 5)[1]


@pytest.mark.parametrize(('name', 'write'), [('a.tum', write_tum), ('a.csv', write_csv)])
def test_stamped_poses_come_back_to_the_nanosecond(tmp_path, path, name, write):
    write(tmp_path / name, path.stamps, path.poses)
    read = read_trajectory(tmp_path / name)
    np.testing.assert_array_equal(read.stamps, path.stamps)
    np.testing.assert_allclose(read.poses, path.poses, atol=1e-11)


def test_kitti_lines_come_back_exactly_and_without_stamps(tmp_path, path):
    write_kitti(tmp_path / 'poses.txt', path.poses)
    read = read_trajectory(tmp_path / 'poses.txt')
    assert read.stamps is None
    np.testing.assert_allclose(read.poses, path.poses, rtol=0, atol=1e-14)
    assert np.loadtxt(tmp_path / 'poses.txt').shape == (5, 12)


def test_comments_empty_lines_and_other_line_ends_are_read(tmp_path):
    (tmp_path / 'a.tum').write_bytes(f'# t x y z\r\n\r\n1e0 {POSE}\r\n 1.5\t{POSE} \r\n'.encode())
    assert read_trajectory(tmp_path / 'a.tum').stamps.tolist() == [10**9, 1_500_000_000]


def test_reads_the_poses_of_kitti(shared_data):
    poses = read_trajectory(shared_data / 'kitti_odometry_07' / 'poses_07_frames0-2.txt').poses
    assert poses.shape == (3, 4, 4)
    assert poses[1, 2, 3] == pytest.approx(0.09154274)


@pytest.mark.parametrize(
    ('name', 'text', 'words'),
    [
        ('a.tum', f'# c\n1 {POSE}\n2 0 0 0 0 0 1\n', 'line 3 is no pose (it holds 7 columns)'),
        ('a.tum', f'1 {POSE}\n2 0 0 x 0 0 0 1\n', 'line 2 is no pose'),
        ('a.tum', f'x {POSE}\n', 'line 1 is no pose (its stamp)'),
        ('a.tum', f'1 {POSE}\n2 0 0 nan 0 0 0 1\n', 'line 2 is no pose (the transform is not'),
        ('a.tum', '1 0 0 0 0 0 0 0\n', 'line 1 is no pose (the quaternion'),
        ('a.tum', f'1 {POSE}\n\n1 {POSE}\n', 'line 3: its stamp is not later than that of line 1'),
        ('a.tum', f'1700000000000000000 {POSE}\n', 'is none in seconds'),
        ('a.tum', f'nan {POSE}\n', 'is none in seconds'),
        ('a.tum', 'this is text\n', 'it must hold the eight numbers t x y z qx qy qz qw'),
        ('a.tum', '# nothing\n', 'holds no pose'),
        ('a.txt', '1 0 0 0 0 1 0 0 0 0 1 0\n' + '2 0 0 0 ' * 3, 'line 2 is no pose (the matrix'),
        ('a.txt', f'1 0 0 0 0 1 0 0 0 0 1 0\n1 {POSE}\n', 'line 2 is no pose (it holds 8'),
        ('a.csv', f'1 {POSE}\n'.replace(' ', ','), 'must begin with the line stamp,x,y,z'),
        ('a.csv', 'stamp,x,y,z,qx,qy,qz,qw\n1,0,0\n', 'line 2 holds 3 words, and its header'),
        ('a.csv', 'stamp,x,y,z,qx,qy,qz,qw\n', 'holds no pose'),
    ],
)
def test_a_bad_line_is_named_by_file_and_number(tmp_path, name, text, words):
    (tmp_path / name).write_text(text)
    with pytest.raises(UnreadableTrajectory) as refused:
        read_trajectory(tmp_path / name)
    assert str(refused.value).startswith(str(tmp_path / name))
    assert words in str(refused.value)
    assert '\n' not in str(refused.value)


@pytest.mark.parametrize('between', [',', ', ', ';', '\t'])
def test_a_mark_commas_and_tabs_are_read(tmp_path, between):
    lines = ['1.5 1 2 3 0 0 0 1', '2.5 2 2 3 0 0 0 1']
    text = '\n'.join(line.replace(' ', between) for line in lines)
    (tmp_path / 'a.txt').write_text(text, encoding='utf-8-sig')
    trajectory = read_trajectory(tmp_path / 'a.txt')
    assert list(trajectory.stamps) == [1_500_000_000, 2_500_000_000]
    np.testing.assert_array_equal(trajectory.poses[:, 0, 3], [1, 2])


@pytest.mark.parametrize('order', ['qw qx qy qz', 'qx qy qz qw'])
def test_a_comment_that_says_where_w_is_is_believed(tmp_path, order):
    path = tmp_path / 'path.txt'
    words = ['1' if name == 'qw' else '0' for name in order.split()]
    path.write_text(f'# timestamp x y z {order}\n1 0 0 0 {" ".join(words)}\n')
    np.testing.assert_array_equal(read_trajectory(path).poses, [np.eye(4)])
    path.write_text(f'# quaternions are {order}\n1 0 0 0 {" ".join(words)}\n')
    if order.startswith('qx'):
        assert read_trajectory(path).stamps.tolist() == [10**9]
        return
    with pytest.raises(UnreadableTrajectory, match='line 1 .* has qw before qx'):
        read_trajectory(path)


def test_what_is_no_text_or_not_there_is_refused(tmp_path):
    (tmp_path / 'a.tum').write_bytes(b'\xff\xfe\x80')
    for name, words in (('a.tum', 'it is no text'), ('b.tum', 'cannot be read')):
        with pytest.raises(UnreadableTrajectory, match=words):
            read_trajectory(tmp_path / name)


def test_nothing_is_left_of_a_file_that_could_not_be_written(tmp_path, path):
    (tmp_path / 'a.tum').write_text('old')
    with pytest.raises(TypeError):
        write_tum(tmp_path / 'a.tum', path.stamps, [*path.poses[:-1], None])
    with pytest.raises(UnwritableFile):
        write_tum(tmp_path / 'no' / 'a.tum', path.stamps, path.poses)
    assert [file.read_text() for file in tmp_path.iterdir()] == ['old']
