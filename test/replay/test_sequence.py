import gc
from dataclasses import replace

import numpy as np
import pytest
from clouds import clouds_made_since, motion, surface
from recordings import FRAMES, START, STEP, scans

from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.recording.messages import cloud_message, transform_message
from idem_ros.recording.topics import TopicNotFound
from idem_ros.recording.writer import write_mcap
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.replay.frames import rotation_error_deg, translation_error_m
from idem_ros.replay.odometry import SCANS_KEPT, continued
from idem_ros.replay.run import replay_each, silent
from idem_ros.replay.settings import Settings

TWIST = np.array([0.02, -0.01, 0.05, 0.03, 0.02, -0.01])
CONFIG = RegistrationConfig(voxel_size=0.08)


def walk(rng, n=8, points=1500, steps=None):
    """Return (scans, truths): a sensor that moves at constant speed around a bumpy surface."""
    start, messages, truths = motion(rng, 30.0, 3.0), [], []
    for i, step in enumerate(range(n) if steps is None else steps):
        truth = start @ se3.exp(step * TWIST)
        source = transform_points(inverse(truth), start[:3, 3] + surface(rng, points))
        stamp = START + step * STEP
        scan = cloud_message(source, stamp, FRAMES[1])
        messages.append(('/points', START + 2 * i, scan))
        pose = transform_message(truth, stamp, *FRAMES)
        messages.append(('/ground_truth', START + 2 * i + 1, pose))
        truths.append(truth)
    return messages, truths


@pytest.fixture
def odometry(tmp_path):
    def run(messages, progress=silent, topics=None, **settings):
        path = tmp_path / 'walk.mcap'
        write_mcap(path, messages)
        settings = Settings(**{'config': CONFIG, 'sequence': 'scan', **settings})
        (result,) = replay_each(path, [settings], progress=progress, **(topics or {}))
        return result

    return run


def poses_of(result):
    return [frame.refinement.result.T_target_source for frame in result.frames]


@pytest.mark.parametrize('sequence', ['scan', 'submap'])
@pytest.mark.parametrize('voxel_size', [None, 0.08])
def test_odometry_follows_the_truth(odometry, rng, sequence, voxel_size):
    messages, truths = walk(rng)
    config = RegistrationConfig(voxel_size=voxel_size)
    result = odometry(messages, sequence=sequence, config=config)
    assert len(result.frames) == 7
    for frame, truth in zip(result.frames, truths[1:], strict=True):
        expected = inverse(truths[0]) @ truth
        np.testing.assert_allclose(frame.truth, expected, atol=1e-6)
        assert frame.error_after().translation_m < 0.03
        assert frame.error_after().rotation_deg < 2.0
    assert (result.sequence.map, result.sequence.first_stamp) == (sequence, START)
    errors = result.sequence.errors
    assert errors['poses'] == {'reference': 8, 'estimate': 8, 'matched': 8}
    assert errors['ape']['translation_m']['max'] == pytest.approx(
        max(frame.error_after().translation_m for frame in result.frames), rel=1e-3
    )


def test_the_guess_is_the_last_motion_continued(odometry, rng):
    messages, _ = walk(rng, steps=(0, 1, 2, 4, 5))
    result = odometry(messages)
    poses = [np.eye(4), *poses_of(result)]
    guesses = [frame.refinement.T_guess for frame in result.frames]
    np.testing.assert_allclose(guesses[0], poses[0])
    last_motion = inverse(poses[1]) @ poses[2]
    np.testing.assert_allclose(guesses[2], poses[2] @ continued(last_motion, 2.0), atol=1e-12)
    half = continued(inverse(poses[2]) @ poses[3], 0.5)
    np.testing.assert_allclose(guesses[3], poses[3] @ half, atol=1e-12)
    first = result.frames[0].refinement
    assert first.q_tot_before > first.result.q_tot


def test_a_motion_continues_at_the_same_speeds():
    twist = np.array([0.1, -0.2, 0.3, 0.0, 0.0, 0.0])
    step = se3.exp(twist)
    step[:3, 3] = 1.0, 2.0, 3.0
    twice = continued(step, 2.0)
    np.testing.assert_allclose(twice[:3, :3], step[:3, :3] @ step[:3, :3], atol=1e-12)
    np.testing.assert_allclose(twice[:3, 3], (2.0, 4.0, 6.0))
    np.testing.assert_allclose(continued(step, 1.0), step, atol=1e-12)


def test_a_submap_drifts_less_than_scan_to_scan(odometry, rng):
    messages, truths = walk(rng, n=16)
    expected = inverse(truths[0]) @ truths[-1]
    ends = [poses_of(odometry(messages, sequence=each))[-1] for each in ('scan', 'submap')]
    turned = [rotation_error_deg(end, expected) for end in ends]
    moved = [translation_error_m(end, expected) for end in ends]
    assert turned[1] < turned[0]
    assert moved[1] < moved[0]


def test_several_methods_follow_the_same_scans(tmp_path, rng):
    pytest.importorskip('small_gicp')
    messages, truths = walk(rng)
    write_mcap(tmp_path / 'walk.mcap', messages)
    settings = [Settings(CONFIG, sequence='submap', method=m) for m in ('idem', 'gicp', 'vgicp')]
    results = replay_each(tmp_path / 'walk.mcap', settings)
    for each, of in zip(results, settings, strict=True):
        assert each.method == of.method
        assert [f.refinement.stamp for f in each.frames] == [START + i * STEP for i in range(1, 8)]
        assert each.frames[-1].error_after().translation_m < 0.05


def test_scans_that_cannot_be_used_are_refused_and_the_others_follow(odometry, rng):
    messages, _ = walk(rng)
    empty = cloud_message(np.full((4, 3), np.nan), START + 3 * STEP, FRAMES[1])
    messages[6] = (*messages[6][:2], empty)
    messages[10][2].header.stamp = messages[2][2].header.stamp
    result = odometry(messages)
    assert len(result.frames) == 5
    assert [refusal.stamp for refusal in result.refused] == [START + 3 * STEP, START + STEP]
    assert 'none of its 4 points is usable' in result.refused[0].reason
    assert 'not later than that of the scan before' in result.refused[1].reason
    assert result.frames[-1].error_after().translation_m < 0.03


def test_where_a_registration_finds_no_answer_the_guess_is_the_pose(odometry, rng):
    messages, _ = walk(rng)
    far = cloud_message(1e5 + surface(rng, 300), START + 3 * STEP, FRAMES[1])
    messages[6] = (*messages[6][:2], far)
    result = odometry(messages, config=replace(CONFIG, radius_schedule=(1.0,)))
    lost = result.frames[2].refinement
    assert lost.result.status.value == 'no_overlap'
    np.testing.assert_array_equal(lost.result.T_target_source, lost.T_guess)


def test_only_a_topic_named_so_is_the_truth(odometry, rng):
    messages, _ = walk(rng)
    renamed = [('/pose' if t == '/ground_truth' else t, time, m) for t, time, m in messages]
    result = odometry(renamed)
    assert result.topics.truth is None
    assert result.sequence.errors is None
    assert {frame.truth is None for frame in result.frames} == {True}
    assert result.notes == ()
    named = odometry(renamed, topics={'truth_topic': 'pose'})
    assert named.sequence.errors['ape']['pairs'] == 8


def test_a_truth_of_another_frame_or_time_is_noted(odometry, rng):
    messages, _ = walk(rng)
    for topic, _, message in messages:
        if topic == '/ground_truth':
            message.child_frame_id = 'camera'
    result = odometry(messages)
    assert result.sequence.errors is None
    assert any("child_frame_id 'camera'" in note for note in result.notes)
    for topic, _, message in messages:
        if topic == '/ground_truth':
            message.child_frame_id = FRAMES[1]
            message.header.stamp.sec += 100
    result = odometry(messages)
    assert result.sequence.errors is None
    assert 'no stamp of the estimate is within' in result.notes[0]


def test_truth_may_begin_after_the_first_scan(odometry, rng):
    messages, truths = walk(rng)
    result = odometry([m for m in messages if m[0] == '/points' or m[1] > START + 5])
    assert [frame.truth is None for frame in result.frames] == [True, True] + 5 * [False]
    tied = result.frames[2]
    np.testing.assert_allclose(tied.truth, tied.refinement.result.T_target_source, atol=1e-9)
    assert result.sequence.errors['poses']['matched'] == 5


def test_every_nth_scan_of_a_span_is_taken(odometry, rng):
    messages, _ = walk(rng)
    spread = [(t, START + i * STEP, m) for i, (t, _, m) in enumerate(messages)]
    result = odometry(spread, every=2, start=0.15)
    expected = [START + i * STEP for i in (3, 5, 7)]
    assert [frame.refinement.stamp for frame in result.frames] == expected
    assert 'sources left out' in result.notes[0]


def test_ranges_hold_for_both_clouds(odometry, rng):
    messages, _ = walk(rng)
    result = odometry(messages, preprocessing=PreprocessingConfig(max_points=1000))
    assert {f.refinement.thinned for f in result.frames} == {500}
    assert {f.refinement.points_target for f in result.frames} <= {1000}


def test_an_interruption_gives_what_was_done(odometry, rng):
    def interrupting(messages, total):
        for i, message in enumerate(messages):
            if i == 9:
                raise KeyboardInterrupt
            yield message

    messages, _ = walk(rng)
    result = odometry(messages, progress=interrupting)
    assert result.interrupted
    assert len(result.frames) == 4
    assert result.sequence.errors['poses']['matched'] == 4


@pytest.mark.parametrize('sequence', ['scan', 'submap'])
def test_memory_is_that_of_the_scans_needed(odometry, rng, sequence):
    held = []
    messages, _ = walk(rng, n=3 * SCANS_KEPT, points=300)
    with clouds_made_since() as alive:

        def watching(messages, total):
            for message in messages:
                held.append(sum(alive()))
                yield message

        result = odometry(messages, progress=watching, sequence=sequence)
        gc.collect()
        assert alive() == []
    assert len(result.frames) == 3 * SCANS_KEPT - 1
    assert max(held[4 * SCANS_KEPT :]) <= 1.5 * max(held[2 * SCANS_KEPT : 4 * SCANS_KEPT])


def test_what_cannot_be_followed_is_refused(odometry, rng):
    with pytest.raises(TopicNotFound, match='no PointCloud2 topic'):
        odometry([m for m in scans(rng) if m[0] == '/ground_truth'])
    one = odometry(walk(rng, n=1)[0])
    assert list(one.frames) == []
    assert any('only one can be used' in note for note in one.notes)
