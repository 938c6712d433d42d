import json
from dataclasses import replace

import numpy as np
import pytest
from clouds import error_of
from sweeps import (
    FRAMES,
    PERIOD,
    START,
    TWIST,
    driven,
    map_message,
    sweep_message,
)

from idem_ros.commands.main import main
from idem_ros.core import RegistrationConfig, undistort
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.recording.messages import header, transform_message, typestore
from idem_ros.recording.reader import open_recording
from idem_ros.recording.writer import write_mcap
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.replay.clouds_again import clouds_of
from idem_ros.replay.run import replay_each
from idem_ros.replay.settings import Settings
from idem_ros.results.result_file import read_result
from idem_ros.results.summary import json_record, table

CONFIG = RegistrationConfig(voxel_size=0.08)
COUNT = 5


def recorded(path, rng, timed=lambda k: True, count=COUNT, imu=False, guess_every=None):
    """A map, sweeps of a drive in it, a guess each 20 ms, the truth of each sweep."""
    logged = [('/target', START, map_message(rng))]
    for k in range(1, count + 1):
        stamp = START + k * PERIOD
        sweep = sweep_message(rng, driven, stamp, timed=timed(k))
        truth = transform_message(driven((stamp - START) / 1e9), stamp, *FRAMES)
        logged += [('/source', stamp + PERIOD, sweep), ('/ground_truth', stamp, truth)]
    last = START + (count + (1 if guess_every is None else 0)) * PERIOD
    for stamp in range(START, last + 1, guess_every or PERIOD // 5):
        pose = driven((stamp - START) / 1e9)
        logged.append(('/initial_guess', stamp, transform_message(pose, stamp, *FRAMES)))
    if imu:
        logged += [('/imu', *imu_message(START + k * 10**7)) for k in range(10 * (count + 2))]
    write_mcap(path, sorted(logged, key=lambda each: each[1]))
    return path


def imu_message(stamp):
    """A stamp and the message of an IMU that turns as the sensor does."""
    types = typestore().types
    vector, still = types['geometry_msgs/msg/Vector3'], np.zeros(9)
    turn = types['geometry_msgs/msg/Quaternion'](0.0, 0.0, 0.0, 1.0)
    rest = still, vector(*TWIST[3:]), still, vector(0.0, 0.0, 9.81), still
    return stamp, types['sensor_msgs/msg/Imu'](header(stamp, FRAMES[1]), turn, *rest)


@pytest.mark.parametrize('reference', ['stamp', 'middle'])
def test_a_replay_undoes_the_motion_between_guesses_and_compares_with_the_truth(
    tmp_path, rng, reference
):
    path = recorded(tmp_path / 'drive.mcap', rng)
    config = replace(CONFIG, motion='guess', motion_reference=reference)
    undone, as_it_is = (replay_each(path, [Settings(config=each)])[0] for each in (config, CONFIG))
    errors = [
        np.median([frame.error_after().translation_m for frame in each.frames])
        for each in (undone, as_it_is)
    ]
    assert errors[0] < 0.003
    assert errors[1] > 5 * errors[0]
    record = json_record(undone)
    frame = next(iter(record['frames']))
    np.testing.assert_allclose(frame['twist'], TWIST, atol=1e-4)
    assert frame['moved'] > 0.01
    assert frame['reference'] == pytest.approx(0.05 if reference == 'middle' else 0.0, abs=1e-3)
    assert 'field time (float32) in s' in frame['point_times']
    assert f'motion of the sweep undone: {COUNT}' in table(undone)
    assert any('field time (float32) in s' in note for note in undone.notes)
    assert 'twist' not in json.dumps(list(json_record(as_it_is)['frames']))


def test_clouds_without_times_among_others_are_registered_as_they_are(tmp_path, rng):
    path = recorded(tmp_path / 'drive.mcap', rng, timed=lambda k: k != 3)
    (replayed,) = replay_each(path, [Settings(config=replace(CONFIG, motion='guess'))])
    flaws = [frame.refinement.result.motion_flaw for frame in replayed.frames]
    assert [bool(flaw) for flaw in flaws] == [k == 3 for k in range(1, COUNT + 1)]
    assert 'motion of the sweep not undone: 1: the source has no times' in table(replayed)
    assert any('it has no field of times; taken as none' in note for note in replayed.notes)


@pytest.mark.parametrize(('sequence', 'motion'), [('scan', 'last'), ('submap', 'solve')])
def test_a_sequence_undoes_each_scan_from_the_first_on(tmp_path, rng, sequence, motion):
    path = recorded(tmp_path / 'drive.mcap', rng, count=8)
    settings = Settings(config=replace(CONFIG, motion=motion), sequence=sequence)
    (undone,) = replay_each(path, [settings], source_topic='/source')
    assert not any(frame.refinement.result.motion_flaw for frame in undone.frames)
    last = undone.frames[-1].refinement.result
    np.testing.assert_allclose(last.twist, TWIST, atol=0.15)
    poses = [undone.frames[k].refinement.result.T_target_source for k in (-2, -1)]
    assert error_of(np.linalg.solve(*poses), driven(PERIOD / 1e9))[1] < 0.01


def test_a_scan_without_times_spoils_no_motion_that_is_solved_after_it(tmp_path, rng):
    path = recorded(tmp_path / 'drive.mcap', rng, timed=lambda k: k != 4, count=7)
    settings = Settings(config=replace(CONFIG, motion='solve'), sequence='scan')
    (undone,) = replay_each(path, [settings], source_topic='/source')
    for frame in undone.frames[3:]:
        assert np.linalg.norm(frame.refinement.result.twist[:3] - TWIST[:3]) < 0.5


def test_the_rates_of_an_imu_are_taken_from_the_topic_that_is_named(tmp_path, rng):
    path = recorded(tmp_path / 'drive.mcap', rng, imu=True)
    settings = Settings(config=replace(CONFIG, motion='guess'))
    with_imu, without = (
        replay_each(path, [settings], **topics)[0] for topics in ({'imu_topic': '/imu'}, {})
    )
    said = "imu: the rates of 'lidar' tell the rotation"
    assert any(said in note for note in with_imu.notes)
    assert not any('imu' in note for note in without.notes)
    assert all(frame.error_after().rotation_deg < 0.3 for frame in with_imu.frames)


@pytest.mark.parametrize('sequence', [[], ['--sequence', 'submap']])
def test_the_clouds_of_a_result_are_undone_again(tmp_path, rng, sequence):
    path, result = recorded(tmp_path / 'drive.mcap', rng), tmp_path / 'result.json'
    options = ['--motion', 'last' if sequence else 'guess', '--voxel-size', '0.08', *sequence]
    topics = ['--source-topic', '/source']
    assert main(['replay', str(path), '--json', str(result), *options, *topics]) == 0
    read = read_result(result)
    ((_, _, source),) = clouds_of(read, [3])
    frame = read.frames[3]
    with open_recording(path) as recording:
        messages = [message for _, _, message in recording.messages(['/source'])]
    (message,) = [each for each in messages if stamp_ns(each) == frame['stamp_ns']]
    points = read_points(message, PointTimeConfig())
    undone = undistort(points.points, points.times.times, frame['twist'], frame['reference'])
    np.testing.assert_allclose(source, undone, atol=1e-12)
    assert np.abs(source - points.points).max() > 0.05


def test_a_replay_that_undid_a_motion_is_repeated_to_the_bit(tmp_path, rng, capsys):
    path, result = recorded(tmp_path / 'drive.mcap', rng, imu=True), tmp_path / 'result.json'
    options = ['--motion', 'solve', '--voxel-size', '0.08', '--imu-topic', '/imu']
    assert main(['replay', str(path), '--json', str(result), *options]) == 0
    assert main(['replay', '--again', str(result)]) == 0
    assert f'{COUNT} of {COUNT} frames agree bit for bit' in capsys.readouterr().out


def test_where_each_sweep_has_one_guess_its_motion_is_that_to_the_next(tmp_path, rng):
    path = recorded(tmp_path / 'drive.mcap', rng, guess_every=PERIOD)
    (replayed,) = replay_each(path, [Settings(config=replace(CONFIG, motion='guess'))])
    assert len(replayed.frames) == COUNT
    for frame in replayed.frames:
        np.testing.assert_allclose(frame.refinement.result.twist, TWIST, atol=1e-4)
        assert frame.error_after().translation_m < 0.004
