from itertools import pairwise

import numpy as np
import pytest
from clouds import motion, surface
from recordings import scans, transforms_of, write_rosbag1, write_sqlite3
from replayed import replayed

from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.messages.transform_message import matrix_of
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.pairing import Pairing
from idem_ros.recording.messages import cloud_message, transform_message, typestore
from idem_ros.recording.reader import UnreadableRecording
from idem_ros.recording.topics import TopicNotFound
from idem_ros.recording.writer import write_mcap
from idem_ros.refinement.refiner import Refiner
from idem_ros.replay.run import replay, replay_each
from idem_ros.replay.settings import Settings

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


def as_poses(messages, make, topic='/initial_guess'):
    """The same messages with the guesses as another type."""
    for name, log_time, message in messages:
        yield (name, log_time, make(message) if name == topic else message)


def type_named(name):
    return typestore().types[name]


def odometry(message):
    pose_type = type_named('geometry_msgs/msg/Pose')
    t = message.transform.translation
    pose = pose_type(
        position=type_named('geometry_msgs/msg/Point')(t.x, t.y, t.z),
        orientation=message.transform.rotation,
    )
    zero = type_named('geometry_msgs/msg/Vector3')(0.0, 0.0, 0.0)
    covariance = np.zeros(36)
    return type_named('nav_msgs/msg/Odometry')(
        header=message.header,
        child_frame_id=message.child_frame_id,
        pose=type_named('geometry_msgs/msg/PoseWithCovariance')(pose, covariance),
        twist=type_named('geometry_msgs/msg/TwistWithCovariance')(
            type_named('geometry_msgs/msg/Twist')(zero, zero), covariance
        ),
    )


def pose_with_covariance(message):
    whole = odometry(message)
    return type_named('geometry_msgs/msg/PoseWithCovarianceStamped')(whole.header, whole.pose)


@pytest.mark.parametrize(
    ('kind', 'make'), [('odometry', odometry), ('pose_with_covariance', pose_with_covariance)]
)
def test_guesses_of_every_type_give_the_same_transforms(tmp_path, messages, kind, make):
    expected = transforms_of(replayed(tmp_path, messages))
    result = replayed(tmp_path, as_poses(messages, make), guess=GuessConfig(type=kind))
    np.testing.assert_array_equal(transforms_of(result), expected)


def test_guesses_come_from_tf_by_way_of_a_frame_between(tmp_path, messages):
    tf_type = type_named('tf2_msgs/msg/TFMessage')
    expected = transforms_of(replayed(tmp_path, messages))
    static = transform_message(np.eye(4), 0, 'base', 'lidar')
    with_tf = [('/tf_static', 0, tf_type([static]))]
    for topic, log_time, message in messages:
        if topic == '/initial_guess':
            message.child_frame_id = 'base'
            topic, message = '/tf', tf_type([message])
        with_tf.append((topic, log_time, message))
    result = replayed(tmp_path, with_tf, guess=GuessConfig(type='tf'))
    assert (result.topics.tf, result.topics.tf_static) == (('/tf',), ('/tf_static',))
    np.testing.assert_allclose(transforms_of(result), expected, atol=1e-9)


@pytest.mark.parametrize('duration', [None, 5.0])
def test_static_transforms_hold_from_the_beginning_however_late_they_come(
    tmp_path, messages, duration
):
    tf_type = type_named('tf2_msgs/msg/TFMessage')
    late = messages[-1][1] + 10**10
    logged = [('/tf_static', late, tf_type([transform_message(np.eye(4), 0, 'base', 'lidar')]))]
    for topic, log_time, message in messages:
        if topic == '/initial_guess':
            message.child_frame_id = 'base'
            topic, message = '/robot/tf', tf_type([message])
        logged.append((topic, log_time, message))
    path = tmp_path / 'late.mcap'
    write_mcap(path, sorted(logged, key=lambda each: each[1]))
    settings = Settings(guess=GuessConfig(type='tf'), duration=duration)
    (result,) = replay_each(path, [settings], tf_topic=['/robot/tf'])
    assert (len(result.frames), len(result.refused), result.unpaired) == (3, 0, 0)
    assert (result.topics.tf, result.topics.tf_static) == (('/robot/tf',), ('/tf_static',))


def test_a_transform_that_tf_lacks_is_a_refusal_with_the_frames_named(tmp_path, messages):
    tf_type = type_named('tf2_msgs/msg/TFMessage')
    other = transform_message(np.eye(4), 0, 'odom', 'base')
    with_tf = [('/tf_static', 0, tf_type([other])), *messages]
    result = replayed(tmp_path, with_tf, guess=GuessConfig(type='tf'))
    assert (len(result.frames), len(result.refused), result.unpaired) == (0, 2, 1)
    assert all("'lidar' with the target frame 'map'" in each.reason for each in result.refused)
    assert "'lidar' with the target frame 'map'" in result.unpaired_why


@pytest.mark.parametrize(('kind', 'name'), [('tf', 'TFMessage'), ('odometry', 'Odometry')])
def test_a_guess_that_was_asked_for_is_never_the_identity_instead(tmp_path, messages, kind, name):
    with pytest.raises(TopicNotFound, match=name):
        replayed(tmp_path, messages, guess=GuessConfig(type=kind))


def test_the_last_result_is_the_guess_of_the_next_source(tmp_path, rng):
    still = motion(rng, 2.0, 0.02)
    target = surface(rng, 400)
    messages = [('/target', 1, cloud_message(target, 1, 'map'))]
    for i in range(3):
        source = transform_points(inverse(still), surface(rng, 400))
        messages.append(('/source', 10 + i, cloud_message(source, 10 + i, 'lidar')))
    result = replayed(tmp_path, messages, guess=GuessConfig(type='last'))
    frames = [frame.refinement for frame in result.frames]
    assert (frames[0].T_guess == np.eye(4)).all()
    for before, after in pairwise(frames):
        np.testing.assert_array_equal(after.T_guess, before.result.T_target_source)
    assert result.notes == ()


def test_the_last_result_begins_anew_with_the_first_guess_that_comes(tmp_path, messages):
    given = replayed(tmp_path, messages).frames[0].refinement.T_guess
    frames = replayed(tmp_path, messages, guess=GuessConfig(type='last')).frames
    before, first, last = (frame.refinement for frame in frames)
    np.testing.assert_array_equal(before.T_guess, np.eye(4))  # a guess follows its source here
    np.testing.assert_array_equal(first.T_guess, given)
    np.testing.assert_array_equal(last.T_guess, first.result.T_target_source)


@pytest.mark.parametrize('kind', ['initial_pose', 'last'])
def test_the_last_result_begins_with_the_pose_of_rviz(tmp_path, messages, kind):
    guesses = [message for topic, _, message in messages if topic == '/initial_guess']
    pose = pose_with_covariance(guesses[0])
    clouds = [each for each in messages if each[0] in ('/target', '/source')]
    clicked = [clouds[0], ('/initialpose', clouds[0][1] + 1, pose), *clouds[1:]]
    result = replayed(tmp_path, clicked, guess=GuessConfig(type=kind))
    np.testing.assert_allclose(
        result.frames[0].refinement.T_guess, matrix_of(guesses[0]), atol=1e-12
    )
    assert result.topics.initial_pose == '/initialpose'


def test_a_recording_whose_clock_goes_back_says_so(tmp_path, messages):
    second = [(topic, log_time + 10**12, message) for topic, log_time, message in messages]
    early = cloud_message(np.ones((5, 3)), 10, 'lidar')
    result = replayed(tmp_path, [*messages, ('/source', 10**11, early), *second])
    assert len(result.frames) == 6
    (note,) = result.notes
    assert 'goes back 1 times, the last time by 1.3 s' in note
