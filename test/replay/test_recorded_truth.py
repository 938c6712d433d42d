"""True poses may be in one frame, or each in that of the scan before: they are told apart."""

import numpy as np
import pytest
from clouds import motion, surface
from recordings import START, STEP, scans

from idem_ros.commands.main import main
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.files.trajectory_file import read_trajectory
from idem_ros.recording.messages import cloud_message, transform_message
from idem_ros.recording.reader import open_recording
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay_each
from idem_ros.replay.settings import Settings
from idem_ros.replay.truths import NoTruth, is_relative, read_truth

COUNT = 5


@pytest.fixture
def poses(rng):
    """Of a sensor that turns and moves on."""
    found = [np.eye(4)]
    for _ in range(COUNT - 1):
        found.append(found[-1] @ motion(rng, 2.0, 0.1))
    return found


def drive(rng, poses, frames=('target', 'source'), truth_frames=None, left_out=()):
    """Yield what `idem bag FOLDER` writes: each scan a target of the next, truth between them."""
    points = surface(rng, 600)
    clouds = [transform_points(inverse(pose), points) for pose in poses]
    for k, cloud in enumerate(clouds):
        stamp = START + k * STEP
        if k:
            step = inverse(poses[k - 1]) @ poses[k]
            yield '/source', stamp, cloud_message(cloud, stamp, frames[1])
            yield '/initial_guess', stamp + 1, transform_message(step, stamp, *frames)
            if k not in left_out:
                named = truth_frames or frames
                yield '/ground_truth', stamp + 2, transform_message(step, stamp, *named)
        if k + 1 < len(poses):
            yield '/target', stamp + STEP // 2, cloud_message(cloud, stamp, frames[0])


@pytest.mark.parametrize('frames', [('target', 'source'), ('lidar', 'lidar'), ('', '')])
def test_odometry_of_scans_with_relative_truth_has_small_errors(tmp_path, rng, poses, frames):
    path = tmp_path / 'x.mcap'
    write_mcap(path, drive(rng, poses, frames))
    (replayed,) = replay_each(path, [Settings(sequence='scan')])
    errors = [frame.error_after() for frame in replayed.frames]
    assert len(errors) == COUNT - 2
    assert max(each.translation_m for each in errors) < 0.02
    assert any('it is chained' in note for note in replayed.notes)
    assert any('empty frame_id' in note for note in replayed.notes) == (not frames[0])


def test_absolute_truth_is_not_chained(tmp_path, rng):
    path = tmp_path / 'x.mcap'
    write_mcap(path, scans(rng))
    with open_recording(path) as recording:
        assert not is_relative(recording, '/ground_truth', '/source')
        trajectory, notes = read_truth(recording)
    assert (len(trajectory), notes) == (3, [])


def test_a_map_that_is_published_again_makes_no_truth_relative(tmp_path, rng):
    messages = [*scans(rng)]
    (_, _, target), *_ = messages
    again = [('/target', START + k * STEP + 9, target) for k in range(1, 4)]
    write_mcap(tmp_path / 'x.mcap', sorted([*messages, *again], key=lambda each: each[1]))
    with open_recording(tmp_path / 'x.mcap') as recording:
        assert not is_relative(recording, '/ground_truth', '/source')


def test_a_command_writes_the_truth_as_a_trajectory(tmp_path, rng, poses, capsys):
    path, out = tmp_path / 'x.mcap', tmp_path / 'truth.tum'
    write_mcap(path, drive(rng, poses))
    assert main(['truth', str(path), '--out', str(out)]) == 0
    written = read_trajectory(out)
    np.testing.assert_allclose(written.poses, poses[1:], atol=1e-9)
    assert written.stamps.tolist() == [START + k * STEP for k in range(1, COUNT)]
    assert 'note: the truth is of each scan in the frame of the one before' in (
        capsys.readouterr().out
    )


def test_where_a_relative_truth_is_missing_the_chain_ends_and_it_says_so(tmp_path, rng, poses):
    write_mcap(tmp_path / 'x.mcap', drive(rng, poses, left_out=[3]))
    with open_recording(tmp_path / 'x.mcap') as recording:
        trajectory, notes = read_truth(recording)
    assert len(trajectory) == 2
    assert 'is missing: the chain ends there, 2 scans are not compared' in notes[1]


def test_a_recording_without_truth_says_what_to_name(tmp_path, rng, capsys):
    path = tmp_path / 'x.mcap'
    write_mcap(path, [each for each in scans(rng) if 'truth' not in each[0]])
    with open_recording(path) as recording, pytest.raises(NoTruth, match='--truth-topic'):
        read_truth(recording)
    assert main(['truth', str(path), '--out', str(tmp_path / 'x.tum')]) == 1
    assert not (tmp_path / 'x.tum').exists()


@pytest.mark.parametrize(
    ('frames', 'words'),
    [(('', 'lidar'), 'an empty frame_id'), (('map', ''), 'an empty child_frame_id')],
)
def test_of_an_empty_reference_frame_it_says_what_is_assumed(tmp_path, rng, frames, words):
    messages = []
    for topic, log_time, message in scans(rng):
        if topic == '/ground_truth':
            message.header.frame_id, message.child_frame_id = frames
        messages.append((topic, log_time, message))
    write_mcap(tmp_path / 'x.mcap', messages)
    (replayed,) = replay_each(tmp_path / 'x.mcap', [Settings()])
    (note,) = replayed.notes
    assert words in note
    assert "it is taken to be the pose of the source 'lidar' in 'map'" in note
    assert replayed.frames[0].error_after() is not None
