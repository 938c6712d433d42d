import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from idem_ros.trajectory.errors import second_differences

STEADY = np.arange(6) * 10**8


def drive(seconds, speed=(1.0, 0.2, 0.0), turning=(0.0, 0.0, 0.3)):
    poses = np.tile(np.eye(4), (len(seconds), 1, 1))
    poses[:, :3, 3] = np.outer(seconds, speed)
    poses[:, :3, :3] = Rotation.from_rotvec(np.outer(seconds, turning)).as_matrix()
    return poses


@pytest.mark.parametrize('stamps', [STEADY, np.array([0, 1, 2, 5, 6, 9]) * 10**8])
def test_a_steady_drive_has_none_even_where_frames_are_missing(stamps):
    positions, rotations = second_differences(stamps, drive(stamps / 1e9))
    np.testing.assert_allclose(positions[1:-1], 0, atol=1e-12)
    np.testing.assert_allclose(rotations[1:-1], 0, atol=1e-5)


def test_the_first_and_the_last_pose_have_none():
    for values in second_differences(STEADY, drive(STEADY / 1e9)):
        np.testing.assert_array_equal(np.isnan(values), [True, *[False] * 4, True])


def test_evenly_spaced_they_are_the_second_differences(rng):
    poses = drive(STEADY / 1e9)
    poses[:, :3, 3] += rng.normal(size=(6, 3))
    positions, _ = second_differences(STEADY, poses)
    p = poses[:, :3, 3]
    expected = np.linalg.norm(p[2:] - 2 * p[1:-1] + p[:-2], axis=1)
    np.testing.assert_allclose(positions[1:-1], expected)


def test_a_pose_that_is_turned_counts_twice_its_turn():
    poses = drive(STEADY / 1e9)
    poses[3, :3, :3] @= Rotation.from_rotvec([0.01, 0, 0]).as_matrix()
    _, rotations = second_differences(STEADY, poses)
    np.testing.assert_allclose(rotations[3], np.degrees(0.02))
    assert rotations[1] < 1e-5 < rotations[2]


@pytest.mark.parametrize('n', [0, 1, 2])
def test_of_fewer_than_three_poses_nothing_is_known(n):
    for values in second_differences(STEADY[:n], drive(STEADY[:n] / 1e9)):
        assert values.shape == (n,)
        assert np.isnan(values).all()


def test_stamps_that_go_back_are_taken_as_even():
    poses = drive(STEADY / 1e9)
    poses[2, :3, 3] += (0.0, 0.0, 1.0)
    positions, _ = second_differences(np.zeros(6, int), poses)
    np.testing.assert_allclose(positions[2], 2.0)
