import numpy as np
import pytest
from clouds import error_of
from scipy.spatial.transform import Rotation
from sweeps import FRAMES, PERIOD, START, driven, sweep_message

from idem_ros.commands.main import main
from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry import se3
from idem_ros.recording.messages import header, transform_message, typestore
from idem_ros.recording.topics import TopicNotFound
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay_each
from idem_ros.replay.settings import Settings

CONFIG = RegistrationConfig(voxel_size=0.08, motion='last')
COUNT, EVERY = 6, 5 * 10**6  # scans; [ns] between two messages of the IMU
TURNED = Rotation.from_euler('xyz', [180.0, 0.0, 90.0], degrees=True).as_matrix()


def swinging(seconds):
    """The pose of a sensor that swings about its vertical axis, by other ways in each sweep."""
    pose = driven(0.0)
    turn = Rotation.from_euler('z', 0.12 * np.sin(2 * np.pi * 7.0 * seconds)).as_matrix()
    pose[:3, :3], pose[0, 3] = pose[:3, :3] @ turn, pose[0, 3] + 0.3 * seconds
    return pose


def rate_at(stamp):
    seconds, step = (stamp - START) / 1e9, 1e-4
    turn = se3.inverse(swinging(seconds - step)) @ swinging(seconds + step)
    return Rotation.from_matrix(turn[:3, :3]).as_rotvec() / (2 * step)


def imu_message(stamp, frame, R_source_imu):
    types = typestore().types
    vector, still = types['geometry_msgs/msg/Vector3'], np.zeros(9)
    turn = types['geometry_msgs/msg/Quaternion'](0.0, 0.0, 0.0, 1.0)
    rate = vector(*(R_source_imu.T @ rate_at(stamp)))
    rest = still, rate, still, vector(0.0, 0.0, 9.81), still
    return types['sensor_msgs/msg/Imu'](header(stamp, frame), turn, *rest)


def recorded(path, rng, frame=FRAMES[1], R_source_imu=None, is_mounted=False):
    """Sweeps of a sensor that swings, its IMU, and where that is mounted, if it is told."""
    turn = np.eye(3) if R_source_imu is None else R_source_imu
    logged = []
    for k in range(COUNT):
        stamp = START + k * PERIOD
        logged.append(('/source', stamp + PERIOD, sweep_message(rng, swinging, stamp)))
    for stamp in range(START, START + (COUNT + 1) * PERIOD, EVERY):
        logged.append(('/imu', stamp, imu_message(stamp, frame, turn)))
    if is_mounted:
        mount = np.eye(4)
        mount[:3, :3] = turn
        told = [transform_message(mount, 0, FRAMES[1], frame)]
        message = typestore().types['tf2_msgs/msg/TFMessage'](told)
        logged.append(('/tf_static', START + PERIOD, message))
    write_mcap(path, sorted(logged, key=lambda each: each[1]))
    return path


def replayed(path, sequence='submap', **topics):
    settings = Settings(config=CONFIG, sequence=sequence)
    (found,) = replay_each(path, [settings], **topics)
    return found


def worst_turn(found):
    """How far the rotations are off, of all scans at their stamps [deg]."""
    worst = 0.0
    for k, frame in enumerate(found.frames, start=1):
        truth = se3.inverse(swinging(0.0)) @ swinging(k * PERIOD / 1e9)
        worst = max(worst, error_of(frame.refinement.result.T_target_source, truth)[0])
    return worst


@pytest.mark.parametrize('sequence', ['scan', 'submap'])
def test_the_rates_of_an_imu_undo_how_the_scans_of_a_sequence_turn(tmp_path, rng, sequence):
    path = recorded(tmp_path / 'drive.mcap', rng)
    with_imu = replayed(path, sequence, imu_topic='imu')
    without = replayed(path, sequence)
    assert worst_turn(with_imu) < 0.5
    assert worst_turn(without) > 3 * worst_turn(with_imu)
    assert any("imu: the rates of 'lidar' tell the rotation" in note for note in with_imu.notes)
    assert not any('imu' in note for note in without.notes)


def test_an_imu_in_a_frame_of_its_own_is_turned_as_static_transforms_have_it(tmp_path, rng):
    path = recorded(tmp_path / 'drive.mcap', rng, 'imu', TURNED, is_mounted=True)
    assert worst_turn(replayed(path, imu_topic='/imu')) < 0.5


def test_an_imu_whose_place_nobody_tells_is_left_out_and_that_is_said(tmp_path, rng):
    path = recorded(tmp_path / 'drive.mcap', rng, 'imu', TURNED)
    with_imu, without = replayed(path, imu_topic='/imu'), replayed(path)
    assert any("nothing tells how its frame 'imu' is turned" in note for note in with_imu.notes)
    poses = [[f.refinement.result.T_target_source for f in x.frames] for x in (with_imu, without)]
    np.testing.assert_array_equal(*poses)


def test_a_topic_that_is_no_imu_is_refused(tmp_path, rng):
    path = recorded(tmp_path / 'drive.mcap', rng)
    with pytest.raises(TopicNotFound, match='the imu must be sensor_msgs/msg/Imu'):
        replayed(path, imu_topic='/source')


def test_a_sequence_with_an_imu_is_repeated_to_the_bit(tmp_path, rng, capsys):
    path, result = recorded(tmp_path / 'drive.mcap', rng), tmp_path / 'result.json'
    options = ['--sequence', 'scan', '--motion', 'last', '--voxel-size', '0.08']
    assert main(['replay', str(path), '--json', str(result), *options, '--imu-topic', 'imu']) == 0
    assert main(['replay', '--again', str(result)]) == 0
    assert f'{COUNT - 1} of {COUNT - 1} frames agree bit for bit' in capsys.readouterr().out
