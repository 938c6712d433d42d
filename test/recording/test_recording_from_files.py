import numpy as np
import pytest
from scans_in_files import scans, write_kitti_sequence, write_numbered
from spinning import sweep

from idem_ros.core.geometry.se3 import inverse
from idem_ros.files.scan_folder import read_scan_folder
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.recording import from_files
from idem_ros.recording.from_files import file_messages, folder_messages
from idem_ros.recording.reader import open_recording
from idem_ros.recording.topics import find_topics
from idem_ros.recording.writer import write_mcap
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.replay.pairs import pairs_of
from idem_ros.replay.run import replay

STAMPS = [0, 5_200_000_000, 5_200_000_100, 5_400_000_000]  # timeless; 100 ns apart


@pytest.fixture
def folder(tmp_path, rng):
    write_numbered(tmp_path / 'scans', *scans(rng), STAMPS)
    return read_scan_folder(tmp_path / 'scans', tmp_path / 'scans' / 'poses.tum')


def pairs(path):
    with open_recording(path) as recording:
        return list(pairs_of(recording, find_topics(recording)))


def true_motions(poses):
    return [inverse(before) @ after for before, after in zip(poses, poses[1:], strict=False)]


@pytest.mark.parametrize('start', ['velocity', 'identity'])
def test_each_scan_is_paired_with_the_one_before_and_its_own_guess(tmp_path, folder, start):
    poses, clouds = scans(np.random.default_rng(0))
    motions = true_motions(poses)
    write_mcap(tmp_path / 'run.mcap', folder_messages(folder, start))
    found = pairs(tmp_path / 'run.mcap')
    guesses = [np.eye(4), *motions[:-1]] if start == 'velocity' else [np.eye(4)] * 3
    assert [pair.stamp for pair in found] == STAMPS[1:]
    for k, (pair, guess) in enumerate(zip(found, guesses, strict=True)):
        np.testing.assert_array_equal(read_points(pair.target).points, clouds[k])
        np.testing.assert_array_equal(read_points(pair.source).points, clouds[k + 1])
        np.testing.assert_allclose(pair.guess.T_target_source, guess, atol=1e-10)


def test_log_times_increase_and_there_is_no_tf(folder):
    logged = [(topic, log_time) for topic, log_time, _ in folder_messages(folder)]
    times = [log_time for _, log_time in logged]
    assert times == sorted(set(times))
    scan = ['/source', '/initial_guess', '/ground_truth', '/target']
    assert [topic for topic, _ in logged] == ['/target', *scan, *scan, *scan[:-1]]


def test_a_scan_is_read_once_and_only_when_its_turn_comes(folder, monkeypatch):
    read = []
    given = from_files.read_timed_cloud
    monkeypatch.setattr(
        from_files, 'read_timed_cloud', lambda path, *how: read.append(path) or given(path)
    )
    topics = []
    for topic, _, _ in folder_messages(folder):
        topics.append(topic)
        assert len(read) == 1 + topics.count('/source')
    assert read == list(folder.scans)


def test_a_replay_finds_the_truth(tmp_path, rng):
    poses, clouds = scans(rng, count=3, points=2000)
    write_kitti_sequence(tmp_path / 'drive', rng, poses, clouds)
    path = tmp_path / 'run.mcap'
    write_mcap(path, folder_messages(read_scan_folder(tmp_path / 'drive'), 'identity'))
    frames = replay(path).frames
    for frame, truth in zip(frames, true_motions(poses), strict=True):
        np.testing.assert_allclose(frame.truth, truth, atol=1e-11)
        assert frame.error_after().translation_m < 0.1 * frame.error_before().translation_m


def test_times_of_points_are_kept(tmp_path, rng):
    points, times = sweep()
    for name, offset in (('target', 0.0), ('source', 0.001)):
        rows = np.empty(len(points), [(axis, 'f4') for axis in 'xyz'] + [('t', 'u4')])
        rows['x'], rows['y'], rows['z'] = points.T + offset
        rows['t'] = (times * 1e9).astype('u4')
        np.save(tmp_path / f'{name}.npy', rows)
    files = tmp_path / 'target.npy', [tmp_path / 'source.npy']
    for _, _, message in file_messages(*files, point_times=PointTimeConfig()):
        read = read_points(message, PointTimeConfig())
        np.testing.assert_allclose(read.times.times, times, atol=1e-8)
        assert 'field time (float32) in s' in read.times.said
