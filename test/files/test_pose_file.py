import os

import numpy as np
import pytest
from clouds import motion

from idem_ros.core import IdemError
from idem_ros.files.atomic_file import UnwritableFile
from idem_ros.files.pose_file import UnreadablePose, read_pose, write_pose, write_tum


def test_a_written_pose_comes_back_exactly(tmp_path, rng):
    transform = motion(rng, 30.0, 1e6)
    write_pose(tmp_path / 'pose.txt', transform)
    np.testing.assert_allclose(read_pose(tmp_path / 'pose.txt'), transform, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(np.loadtxt(tmp_path / 'pose.txt'), transform)


def test_a_tum_line_comes_back(tmp_path, rng):
    transform = motion(rng, 30.0, 2.0)
    write_tum(tmp_path / 'pose.tum', [1_700_000_000_123_456_789], [transform])
    assert (tmp_path / 'pose.tum').read_text().startswith('1700000000.123456789 ')
    np.testing.assert_allclose(read_pose(tmp_path / 'pose.tum'), transform, atol=1e-11)


def test_tum_has_a_line_for_each_stamp(tmp_path):
    write_tum(tmp_path / 'poses.tum', [10**9, 1_100_000_000], [np.eye(4)] * 2)
    lines = (tmp_path / 'poses.tum').read_text().splitlines()
    assert [line.split()[0] for line in lines] == ['1.000000000', '1.100000000']
    assert [float(number) for number in lines[0].split()[1:]] == [0, 0, 0, 0, 0, 0, 1]


def test_a_quaternion_is_normalised_and_comments_are_skipped(tmp_path):
    (tmp_path / 'pose.txt').write_text('# t x y z qx qy qz qw\n0 1 2 3 0 0 0 0.999\n')
    expected = np.eye(4)
    expected[:3, 3] = 1, 2, 3
    np.testing.assert_array_equal(read_pose(tmp_path / 'pose.txt'), expected)


def test_a_matrix_of_few_digits_is_made_orthonormal(tmp_path):
    (tmp_path / 'pose.txt').write_text('0.8660 -0.5 0 1\n0.5 0.8660 0 2\n0 0 1 3\n0 0 0 1\n')
    rotation = read_pose(tmp_path / 'pose.txt')[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-15)


@pytest.mark.parametrize(
    'content',
    [
        '',
        'this is no pose',
        '1 0 0\n0 1 0\n0 0 1\n',
        '1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n0 0 0 1\n',
        '1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 1 1\n',
        '2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n',
        '1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n',
        '1e300 -1e300 0 0\n1e300 1e300 0 0\n0 0 1 0\n0 0 0 1\n',
        '1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n',
        '0 1 2 3 0 0 0 0\n',
        '0 1 2 3 0 0 0 2\n',
        '0 1 2 3 0.1 -0.2 0.3 1\n',
        '1_0 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n',
        '0 1 2 3 0 0 0 nan\n',
        '0 inf 2 3 0 0 0 1\n',
        '0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 1\n',
    ],
)
def test_what_is_no_pose_is_refused_in_one_line_with_the_name(tmp_path, content):
    path = tmp_path / 'pose.txt'
    path.write_text(content)
    with pytest.raises(IdemError) as refused:
        read_pose(path)
    assert str(path) in str(refused.value)
    assert '\n' not in str(refused.value)


def test_a_pose_without_a_time_is_told_where_to_put_one(tmp_path):
    (tmp_path / 'pose.txt').write_text('1 2 3 0 0 0 1\n')
    with pytest.raises(UnreadablePose, match='begins with a time: put 0 before it'):
        read_pose(tmp_path / 'pose.txt')


ROWS = ['0 -1 0 1.5', '1 0 0 2', '0 0 1 -3', '0 0 0 1']


@pytest.mark.parametrize('encoding', ['utf-8', 'utf-8-sig', 'utf-16'])
@pytest.mark.parametrize('between', [' ', ',', ', ', ';', '\t', ' ; '])
@pytest.mark.parametrize('rows', [3, 4])
@pytest.mark.parametrize('end', ['\n', '\r\n', ' '])
def test_a_matrix_comes_in_rows_or_in_a_line_with_any_separator(
    tmp_path, encoding, between, rows, end
):
    end = between if end == ' ' else end
    text = end.join(row.replace(' ', between) for row in ROWS[:rows]) + '\n'
    (tmp_path / 'pose.txt').write_text(text, encoding=encoding, newline='')
    expected = [[float(word) for word in row.split()] for row in ROWS]
    np.testing.assert_array_equal(read_pose(tmp_path / 'pose.txt'), expected)


@pytest.mark.parametrize('between', [' ', ';', '\t', '; '])
def test_a_comma_is_the_decimal_sign_where_something_else_separates(tmp_path, between):
    rows = [row.replace(' ', between).replace('.', ',') for row in ROWS]
    (tmp_path / 'pose.txt').write_text('\n'.join(rows))
    assert read_pose(tmp_path / 'pose.txt')[:3, 3].tolist() == [1.5, 2.0, -3.0]


def test_commas_that_both_part_and_round_are_no_pose(tmp_path):
    (tmp_path / 'pose.txt').write_text('1,0,0,0,0,0,0,0\n0,0,1,0,0,0,0,0\n0,0,0,0,1,0,0,0\n')
    with pytest.raises(UnreadablePose, match='lines of 8, 8, 8 numbers'):
        read_pose(tmp_path / 'pose.txt')


def test_a_pipe_named_as_a_pose_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / 'pose.txt')
    with pytest.raises(UnreadablePose, match='a pipe'):
        read_pose(tmp_path / 'pose.txt')


def test_a_missing_or_binary_file_is_refused(tmp_path):
    with pytest.raises(UnreadablePose, match=r'nowhere.txt cannot be read: No such file[^:]*$'):
        read_pose(tmp_path / 'nowhere.txt')
    (tmp_path / 'binary.txt').write_bytes(bytes(range(256)))
    with pytest.raises(UnreadablePose, match='binary.txt'):
        read_pose(tmp_path / 'binary.txt')


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(UnwritableFile, match='nowhere does not exist'):
        write_pose(tmp_path / 'nowhere' / 'pose.txt', np.eye(4))


def test_reads_real_poses(shared_data):
    for name in ('small_gicp/T_target_source.txt', 'cross_source/threechair/T_gt.txt'):
        assert read_pose(shared_data / name).shape == (4, 4)
