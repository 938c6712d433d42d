import numpy as np
import pytest
from recordings import scans, transforms_of, write_rosbag1, write_sqlite3
from replayed import replayed

from idem_ros.core import RegistrationConfig
from idem_ros.pairing.pairing import Pairing
from idem_ros.recording.messages import cloud_message
from idem_ros.recording.reader import UnreadableRecording
from idem_ros.recording.topics import TopicNotFound
from idem_ros.recording.writer import write_mcap
from idem_ros.refinement.refiner import Refiner
from idem_ros.replay.run import replay

ROLES = {'/target': 'add_target', '/source': 'add_source', '/initial_guess': 'add_guess'}


@pytest.fixture
def messages(rng):
    return list(scans(rng))


def test_every_source_is_refined_towards_the_truth(tmp_path, messages):
    result = replayed(tmp_path, messages)
    assert [frame.refinement.stamp for frame in result.frames] == [
        1_100_000_000,
        1_200_000_000,
        1_300_000_000,
    ]
    for frame in result.frames:
        assert frame.error_before().rotation_deg == pytest.approx(2.0, abs=1e-6)
        assert frame.error_after().rotation_deg < 1.0
        assert frame.error_after().translation_m < frame.error_before().translation_m
    assert (list(result.refused), result.dropped, result.unpaired) == ([], 0, 0)
    assert result.notes == ()


def test_it_gives_what_the_node_computes_of_the_same_messages(tmp_path, messages):
    pairing, refiner, expected = Pairing(), Refiner(), []
    for topic, _, message in messages:
        if topic in ROLES:
            pairs = getattr(pairing, ROLES[topic])(message)
            expected.extend(refiner.refine(pair).result.T_target_source for pair in pairs)
    result = replayed(tmp_path, messages)
    np.testing.assert_allclose(transforms_of(result), expected, rtol=0, atol=1e-9)


def test_sqlite3_and_ros1_give_the_same_transforms(tmp_path, messages):
    expected = transforms_of(replayed(tmp_path, messages))
    write_sqlite3(tmp_path / 'sqlite3', messages)
    write_rosbag1(tmp_path / 'scans.bag', messages)
    for path in (tmp_path / 'sqlite3', tmp_path / 'scans.bag'):
        result = replay(path)
        np.testing.assert_array_equal(transforms_of(result), expected)
        assert all(frame.truth is not None for frame in result.frames)


def test_the_configuration_reaches_the_core(tmp_path, messages):
    result = replayed(tmp_path, messages, config=RegistrationConfig(max_iterations=1))
    assert {f.refinement.result.status.value for f in result.frames} == {'max_iterations'}


def test_without_guesses_each_source_starts_from_the_identity_and_it_says_so(tmp_path, messages):
    result = replayed(tmp_path, [m for m in messages if m[0] != '/initial_guess'])
    assert len(result.frames) == 3
    assert all((frame.refinement.T_guess == np.eye(4)).all() for frame in result.frames)
    assert result.notes == ('no guess topic: each source starts from the identity',)


def test_without_truth_there_are_no_errors(tmp_path, messages):
    result = replayed(tmp_path, [m for m in messages if m[0] != '/ground_truth'])
    assert {frame.error_before() for frame in result.frames} == {None}
    assert {frame.error_after() for frame in result.frames} == {None}


def test_a_truth_of_other_frames_is_not_believed(tmp_path, messages):
    for topic, _, message in messages:
        if topic == '/ground_truth':
            message.header.frame_id = 'odom'
    result = replayed(tmp_path, messages)
    assert {frame.truth is None for frame in result.frames} == {True}
    assert len(result.notes) == 1
    assert "the truth has frame_id 'odom'" in result.notes[0]


def test_a_truth_that_is_no_transform_is_noted(tmp_path, messages):
    for topic, _, message in messages:
        if topic == '/ground_truth':
            message.transform.rotation = type(message.transform.rotation)(0.0, 0.0, 0.0, 0.0)
    result = replayed(tmp_path, messages)
    assert {frame.truth is None for frame in result.frames} == {True}
    assert 'truth: the quaternion' in result.notes[0]


def test_a_refused_source_is_reported_and_the_others_are_refined(tmp_path, messages):
    topic, log_time, message = messages[4]
    assert topic == '/source'
    empty = cloud_message(np.full((5, 3), np.nan), 1_200_000_000, 'lidar')
    messages[4] = (topic, log_time, empty)
    result = replayed(tmp_path, messages)
    assert [frame.refinement.stamp for frame in result.frames] == [1_100_000_000, 1_300_000_000]
    (refusal,) = result.refused
    assert refusal.stamp == 1_200_000_000
    assert refusal.reason == 'source: none of its 5 points is usable: 5 not finite, 0 exactly zero'


def test_frames_that_contradict_are_reported(tmp_path, messages):
    messages[2][2].header.frame_id = 'odom'
    result = replayed(tmp_path, messages)
    assert len(result.frames) == 2
    assert [refusal.stamp for refusal in result.refused] == [1_100_000_000]


def test_sources_without_a_guess_are_counted_as_unpaired(tmp_path, messages):
    guesses = [m for m in messages if m[0] == '/initial_guess']
    result = replayed(tmp_path, [m for m in messages if m is not guesses[-1]])
    assert (len(result.frames), result.unpaired) == (2, 1)
    assert result.unpaired_for == 'initial_guess'


def test_sources_that_nobody_waits_for_are_counted_as_dropped(tmp_path, rng):
    messages = [m for m in scans(rng, n=10) if m[0] in ('/target', '/source')]
    later = [(t, time + 10**10, m) for t, time, m in scans(rng, n=1) if t == '/initial_guess']
    result = replayed(tmp_path, messages + later)
    assert (len(result.frames), result.dropped, result.unpaired) == (0, 2, 8)


def test_progress_sees_every_message(tmp_path, messages):
    seen = []

    def progress(iterable, total):
        for item in iterable:
            seen.append((item[0], total))
            yield item

    replayed(tmp_path, messages, progress=progress)
    assert seen == [(topic, 10) for topic, _, _ in messages]


def test_a_recording_cut_off_is_replayed_as_far_as_it_goes(tmp_path, rng):
    path = tmp_path / 'scans.mcap'
    write_mcap(path, scans(rng, n=4, points=25_000))
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    result = replay(path, RegistrationConfig(voxel_size=0.2, max_iterations=5))
    assert 1 <= len(result.frames) < 4
    (note,) = result.notes
    assert 'cut off' in note


def test_what_cannot_be_replayed_is_refused(tmp_path, messages):
    with pytest.raises(UnreadableRecording, match='does not exist'):
        replay(tmp_path / 'nowhere.mcap')
    with pytest.raises(TopicNotFound, match='no PointCloud2 topic'):
        replayed(tmp_path, [m for m in messages if m[0] == '/ground_truth'])


def test_the_truck_finds_its_exact_truth(shared_data):
    result = replay(
        shared_data / 'bags/truck_icp_test/default_conf.mcap_0.mcap',
        target_topic='cloud_3',
        source_topic='cloud_1',
        config=RegistrationConfig(voxel_size=None),  # the same points: voxels would cut them anew
    )
    (frame,) = result.frames
    translation = frame.refinement.result.T_target_source[:3, 3]
    np.testing.assert_allclose(translation, (-0.500192337, 0.713268554, 2.70608306), atol=1e-4)
    assert frame.refinement.dropped_zero == 2 * 60_192


def test_a_recording_whose_clock_goes_back_says_so(tmp_path, messages):
    second = [(topic, log_time + 10**12, message) for topic, log_time, message in messages]
    early = cloud_message(np.ones((5, 3)), 10, 'lidar')
    result = replayed(tmp_path, [*messages, ('/source', 10**11, early), *second])
    assert len(result.frames) == 6
    (note,) = result.notes
    assert 'goes back 1 times, the last time by 1.3 s' in note


def test_sources_of_one_stamp_are_noted(tmp_path, messages):
    again = [(topic, log_time + 10, message) for topic, log_time, message in messages]
    (note,) = replayed(tmp_path, sorted([*messages, *again], key=lambda each: each[1])).notes
    assert '3 sources have the stamp of one before' in note
