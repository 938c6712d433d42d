import numpy as np
import pytest
from clouds import motion

from idem_ros.core import IdemError
from idem_ros.core.geometry import se3
from idem_ros.files.pose_file import read_poses, write_poses


@pytest.fixture
def poses(rng):
    return np.array([motion(rng, 40, 2.0) for _ in range(3)])


@pytest.mark.parametrize('name', ['poses.txt', 'poses.tum', 'poses.mat', 'poses.g2o'])
def test_poses_are_read_as_they_were_written(tmp_path, poses, name):
    write_poses(tmp_path / name, poses)
    np.testing.assert_allclose(read_poses(tmp_path / name, 3), poses, atol=1e-10)


@pytest.mark.parametrize('numbers', [12, 16])
def test_a_matrix_may_fill_a_line(tmp_path, poses, numbers):
    file = tmp_path / 'poses.txt'
    np.savetxt(file, poses.reshape(3, 16)[:, :numbers], delimiter=', ')
    np.testing.assert_allclose(read_poses(file, 3), poses, atol=1e-10)


def test_an_edge_has_the_information_of_its_covariance(tmp_path, poses, rng):
    root = rng.normal(size=(6, 6))
    covariance = root @ root.T + np.eye(6)
    write_poses(tmp_path / 'graph.g2o', poses, [(0, 2, covariance)])
    (line,) = (s for s in (tmp_path / 'graph.g2o').read_text().splitlines() if 'EDGE' in s)
    words = line.split()
    assert words[:3] == ['EDGE_SE3:QUAT', '0', '2']
    information = np.zeros((6, 6))
    information[np.triu_indices(6)] = [float(word) for word in words[10:]]
    information += np.triu(information, 1).T
    T = se3.inverse(poses[0]) @ poses[2]
    turn = np.kron(np.eye(2), T[:3, :3])  # from the axes of cloud 2 to those of cloud 0
    np.testing.assert_allclose(turn @ np.linalg.inv(information) @ turn.T, covariance, rtol=1e-5)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('', '0 poses for 2 clouds'),
        ('0 0 0 0 0 0 0 1\n', '1 poses for 2 clouds'),
        ('0 0 0 0 0 0 1\n' * 2, 'put 0 before it'),
        ('0 0 0 0 0 0 0 0\n' * 2, 'quaternion'),
        ('1 0 0 0\n' * 7, '7 rows'),
        ('1 2 3\n' * 2, 'line 1 has 3 numbers'),
        ('a b c d\n', "line 1 is 'a b c d'"),
        ('1 0 0 0 0 2 0 0 0 0 1 0\n' * 2, 'not rigid'),
    ],
)
def test_what_holds_no_poses_is_refused_by_name(tmp_path, text, words):
    file = tmp_path / 'poses.txt'
    file.write_text(text)
    with pytest.raises(IdemError, match=words) as error:
        read_poses(file, 2)
    assert str(file) in str(error.value)


def test_no_file_is_said(tmp_path):
    with pytest.raises(IdemError, match='No such file'):
        read_poses(tmp_path / 'none.txt', 2)
