import json

import numpy as np
import pytest
from clouds import motion
from results import write_result

from idem_ros.core.geometry import se3
from idem_ros.files.pose_file import write_tum
from idem_ros.files.trajectory_file import Trajectory
from idem_ros.refinement.sweep_motion import UnknownMotion
from idem_ros.smoothing.odometry import Odometry, UnusableTrajectory, read_odometry

SECOND = 10**9


@pytest.fixture
def odometry():
    """Ten poses a second for a second, then a gap of two, then another."""
    stamps = [*range(SECOND, 2 * SECOND + 1, SECOND // 10), 4 * SECOND]
    poses = np.array([se3.translation((stamp / 1e9, 0.0, 0.0)) for stamp in stamps])
    return Odometry(Trajectory(poses, np.array(stamps)))


def test_a_pose_is_that_of_the_stamp_or_between_two(odometry):
    assert odometry.at(SECOND)[0, 3] == 1.0
    assert odometry.at(SECOND + 400)[0, 3] == 1.0  # stamps of six digits
    assert odometry.at(1_250_000_000)[0, 3] == pytest.approx(1.25)
    assert odometry.at(4 * SECOND)[0, 3] == 4.0


@pytest.mark.parametrize('stamp', [0, SECOND - 2_000_000, 3 * SECOND, 5 * SECOND])
def test_before_after_and_in_a_gap_there_is_none(odometry, stamp):
    assert odometry.at(stamp) is None


def test_the_motion_of_a_sweep_is_that_of_the_poses_around(odometry):
    track = odometry.track(1_300_000_000)
    assert track.step(0.0, 0.1)[0, 3] == pytest.approx(0.1)
    with pytest.raises(UnknownMotion):
        odometry.track(3 * SECOND)


def test_the_result_of_a_sequence_is_its_trajectory(tmp_path, rng):
    poses = [motion(rng, 10.0, 1.0) for _ in range(3)]
    path = tmp_path / 'drive.json'
    write_result(path, q_tot=[1.0] * 3)
    record = json.loads(path.read_text())
    stamps = [2 * SECOND, 3 * SECOND, 4 * SECOND]
    for frame, stamp, T in zip(record['frames'], stamps, poses, strict=True):
        frame.update(stamp_ns=stamp, T_target_source=T.tolist())
    path.write_text(json.dumps(record))
    with pytest.raises(UnusableTrajectory, match='of pairs, not of a sequence'):
        read_odometry(path)
    record['sequence'] = {'map': 'scan', 'first_stamp': SECOND, 'errors': None}
    path.write_text(json.dumps(record))
    found = read_odometry(path)
    np.testing.assert_array_equal(found.stamps, [SECOND, *stamps])
    np.testing.assert_allclose(found.poses, [np.eye(4), *poses])


def test_poses_without_stamps_are_refused(tmp_path):
    path = tmp_path / 'kitti.txt'
    path.write_text('1 0 0 0 0 1 0 0 0 0 1 0\n' * 3)
    with pytest.raises(UnusableTrajectory, match='without stamps'):
        read_odometry(path)
    write_tum(tmp_path / 'a.tum', [SECOND], [np.eye(4)])
    assert len(read_odometry(tmp_path / 'a.tum')) == 1
