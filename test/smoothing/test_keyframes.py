import numpy as np
import pytest
from drives import drive, stamps_of

from idem_ros.files.trajectory_file import Trajectory
from idem_ros.recording.messages import cloud_message
from idem_ros.replay.settings import Settings
from idem_ros.smoothing.config import SmoothingConfig
from idem_ros.smoothing.keyframes import KeyframeClouds, Reader
from idem_ros.smoothing.odometry import Odometry


@pytest.fixture
def scans(rng):
    clouds, truth, _ = drive(rng, 6, points=60)
    return clouds, truth, np.array(stamps_of(6))


def reader(folder, poses, stamps, **config):
    odometry = Odometry(Trajectory(poses, stamps))
    return Reader(odometry, KeyframeClouds(folder), Settings(), SmoothingConfig(**config))


def take(reader, clouds, stamps):
    for points, stamp in zip(clouds, stamps.tolist(), strict=True):
        reader.take(cloud_message(points, stamp, 'lidar'))
    return reader.scans


def test_keyframes_are_so_far_apart_and_their_points_are_on_disk(tmp_path, scans):
    clouds, poses, stamps = scans
    found = take(reader(tmp_path, poses, stamps, keyframe_distance=0.6), clouds, stamps)
    assert list(found.keyframes) == [0, 2, 4]  # 0.38 m from scan to scan
    assert len(found.stamps) == 6
    np.testing.assert_allclose(KeyframeClouds(tmp_path).read(1), clouds[2], atol=1e-6)
    turning = reader(tmp_path, poses, stamps, keyframe_distance=9.0, keyframe_turn=15.0)
    assert list(take(turning, clouds, stamps).keyframes) == [0, 3]  # 5.6 deg from scan to scan


def test_scans_without_a_pose_are_counted_and_the_first_is_named(tmp_path, scans):
    clouds, poses, stamps = scans
    found = take(reader(tmp_path, poses[1:4], stamps[1:4]), clouds, stamps)
    assert (found.uncovered, found.first_uncovered) == (3, stamps[0])
    assert list(found.stamps) == stamps[1:4].tolist()


def test_scans_that_cannot_be_used_are_counted_and_the_next_takes_their_place(tmp_path, scans):
    clouds, poses, stamps = scans
    clouds[2] = np.full((5, 3), np.nan)
    stamps = stamps.copy()
    given = stamps.copy()
    given[4] = stamps[3]
    found = take(reader(tmp_path, poses, stamps, keyframe_distance=0.3), clouds, given)
    assert found.refused == 2
    assert 'not finite' in found.reasons[0]
    assert 'not later' in found.reasons[1]
    assert [int(found.stamps[k]) for k in found.keyframes] == stamps[[0, 1, 3, 5]].tolist()


def test_points_far_from_zero_keep_their_digits(tmp_path):
    points = np.array([[4_500_000.123456, 1.0, 2.0]])
    KeyframeClouds(tmp_path).write(0, points)
    np.testing.assert_array_equal(KeyframeClouds(tmp_path).read(0), points)
