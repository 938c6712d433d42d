"""The node as its own process refines what replay refines."""

import json

import pytest
from live import rclpy  # noqa: F401  (before the messages, so that they check their fields)

# isort: split
import numpy as np
from recordings import scans

from idem_ros.commands.main import main
from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry.se3 import exp
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.node import live_run
from idem_ros.node.environment import loopback_environment
from idem_ros.node.live_run import NodeFailed, refine_live
from idem_ros.recording.messages import transform_message
from idem_ros.recording.reader import open_recording
from idem_ros.recording.topics import find_topics
from idem_ros.recording.writer import write_mcap
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.replay.run import replay

PATIENCE = 120.0  # a scan that needs it fails; none that passes does


@pytest.fixture(autouse=True)
def own_domain(monkeypatch):
    for name, value in loopback_environment().items():
        monkeypatch.setenv(name, value)


@pytest.fixture
def bag(tmp_path, rng):
    path = tmp_path / 'scans.mcap'
    write_mcap(path, scans(rng))
    return path


def live_scans(path, parameters=None, guess_type='transform', **options):
    with open_recording(path) as recording:
        topics = find_topics(recording, guess_type=guess_type)
        return list(
            refine_live(recording, topics, parameters, rate=100.0, patience=PATIENCE, **options)
        )


def assert_live_equals_replay(path, config):
    parameters = {name: value for name, value in vars(config).items() if value is not None}
    live = live_scans(path, parameters)
    frames = replay(str(path), config).frames
    assert [scan.stamp for scan in live] == [frame.refinement.stamp for frame in frames]
    for scan, frame in zip(live, frames, strict=True):
        expected = frame.refinement.result
        sent = through_message(expected.T_target_source)
        np.testing.assert_array_equal(scan.T_target_source, sent)
        assert scan.diagnostics['status'] == expected.status.value
        assert float(scan.diagnostics['q_tot']) == expected.q_tot
        assert scan.diagnostics['dropped'] == '0'
        np.testing.assert_allclose(scan.T_guess, frame.refinement.T_guess, rtol=0, atol=1e-12)
        np.testing.assert_allclose(scan.T_truth, frame.truth, rtol=0, atol=1e-12)


def test_live_transforms_equal_those_of_replay_and_the_truth_comes_with_each(bag):
    assert_live_equals_replay(bag, RegistrationConfig(voxel_size=0.05, radius_schedule=(2.0, 1.0)))


def test_live_and_replay_interpolate_guesses_and_leave_points_out_alike(tmp_path, rng):
    messages = []
    for topic, log_time, message in scans(rng):
        if topic != '/initial_guess':
            messages.append((topic, log_time, message))
            continue
        for shift in (-20_000_000, 20_000_000):
            pose = matrix_of(message) @ exp(np.full(6, shift / 1e10))
            at = stamp_ns(message) + shift
            near = transform_message(pose, at, 'map', 'lidar')
            messages.append((topic, log_time + shift, near))
    path = tmp_path / 'between.mcap'
    write_mcap(path, sorted(messages, key=lambda logged: logged[1]))
    limits = {'max_points': 350, 'max_range': 3.0}
    live = live_scans(path, limits)
    frames = replay(str(path), preprocessing=PreprocessingConfig(**limits)).frames
    assert len(frames) == len(live) == 3
    for scan, frame in zip(live, frames, strict=True):
        sent = frame.refinement.result.T_target_source
        np.testing.assert_array_equal(scan.T_target_source, through_message(sent))
        assert frame.refinement.thinned > 0


def through_message(transform):
    """Return what is left of the last digits of a transform that was sent as a quaternion."""
    return matrix_of(transform_message(transform, 1, '', ''))


@pytest.mark.parametrize(
    ('folder', 'target', 'source', 'voxel_size', 'offset'),
    [
        ('kitti_odometry_07', '0000000000.bin', '0000000001.bin', 0.5, 0.3),
        ('small_gicp', 'target.ply', 'source.ply', 0.5, 0.3),
        ('stanford_bunny/data', 'bun000.ply', 'bun045.ply', 0.002, 0.002),
    ],
)
def test_live_transforms_of_real_clouds_equal_those_of_replay(
    shared_data, tmp_path, folder, target, source, voxel_size, offset
):
    pairs = json.loads((shared_data / 'GROUND_TRUTH.json').read_text())['pairs']
    (pair,) = [
        p for p in pairs if (p['item'], p['target'], p['source']) == (folder, target, source)
    ]
    truth, guess, out = (tmp_path / name for name in ('truth.txt', 'guess.txt', 'pair.mcap'))
    T_truth = np.array(pair['T_target_source'])
    np.savetxt(truth, T_truth)
    np.savetxt(guess, exp(np.array([0.0, 0.0, np.radians(1.5), offset, 0.0, 0.0])) @ T_truth)
    clouds = [str(shared_data / folder / name) for name in (target, source)]
    poses = ['--guess', str(guess), '--truth', str(truth)]
    assert main(['bag', *clouds, *poses, '--out', str(out)]) == 0
    assert_live_equals_replay(out, RegistrationConfig(voxel_size=voxel_size))


def test_node_that_cannot_start_is_reported(bag):
    with pytest.raises(NodeFailed, match='exit code 2'):
        live_scans(bag, {'a': -1.0})


@pytest.fixture
def processes(monkeypatch):
    """The processes that live_run starts."""
    started = []
    popen = live_run.subprocess.Popen

    def recorded(command):
        started.append(popen(command))
        return started[-1]

    monkeypatch.setattr(live_run.subprocess, 'Popen', recorded)
    return started


def test_node_that_dies_is_reported(bag, processes):
    with open_recording(bag) as recording:
        scans = refine_live(recording, find_topics(recording), patience=1.0)
        next(scans)
        processes[0].terminate()
        with pytest.raises(NodeFailed, match='has ended with exit code 0'):
            list(scans)


def test_node_ends_when_its_scans_are_no_longer_asked_for(bag, processes):
    with open_recording(bag) as recording:
        scans = refine_live(recording, find_topics(recording), patience=PATIENCE)
        next(scans)
        scans.close()
    assert processes[0].returncode == 0
