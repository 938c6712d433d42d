"""Where the guesses of a replay come from."""

from itertools import pairwise

import numpy as np
import pytest
from clouds import motion, surface
from recordings import scans, transforms_of
from replayed import replayed

from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.messages.transform_message import matrix_of
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.recording.messages import cloud_message, transform_message, typestore
from idem_ros.recording.topics import TopicNotFound
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay_each
from idem_ros.replay.settings import Settings


@pytest.fixture
def messages(rng):
    return list(scans(rng))


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
