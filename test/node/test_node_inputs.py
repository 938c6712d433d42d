"""The node in this process: guesses of every type, pairing by stamps, clocks that are set back."""

from importlib.util import find_spec
from types import SimpleNamespace

import poses
import pytest
from node_bench import FIRST, MS, T_TRUTH, cloud_message, guess_message, send

# isort: split
import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.event_handler import QoSSubscriptionEventType
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from idem_ros.core import InvalidConfig, register
from idem_ros.core.geometry.se3 import exp
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.node import subscriptions
from idem_ros.node.messages import time_message
from idem_ros.pairing.stamped_poses import interpolated

SECOND = 1000 * MS


def values(status):
    return {each.key: each.value for each in status.values}


def publish_clouds(bench, clouds, stamp):
    bench.target.publish(cloud_message(clouds[0], stamp - 10 * MS, 'map'))
    bench.source.publish(cloud_message(clouds[1], stamp, 'lidar'))


def pose_message(kind, transform, stamp, frame_id='map', child_frame_id='lidar'):
    """The same as `guess_message`, as a pose with covariance or as odometry."""
    stamped = guess_message(transform, stamp, frame_id, child_frame_id)
    message = kind(header=stamped.header)
    if kind is Odometry:
        message.child_frame_id = child_frame_id
    t, p = stamped.transform.translation, message.pose.pose.position
    p.x, p.y, p.z = t.x, t.y, t.z
    message.pose.pose.orientation = stamped.transform.rotation
    return message


@pytest.mark.parametrize(
    ('name', 'kind'),
    [('pose_with_covariance', PoseWithCovarianceStamped), ('odometry', Odometry)],
)
def test_guess_of_another_type_gives_the_transform_that_the_core_gives(bench, clouds, name, kind):
    b = bench(guess_type=name, guess_class=kind).start()
    publish_clouds(b, clouds, FIRST)
    b.guess.publish(pose_message(kind, np.eye(4), FIRST))
    expected = register(*clouds, np.eye(4)).T_target_source
    np.testing.assert_allclose(matrix_of(b.transform_of(FIRST)), expected, rtol=0, atol=1e-9)


def test_odometry_of_other_frames_is_refused_by_name(bench, clouds):
    b = bench(guess_type='odometry', guess_class=Odometry).start()
    publish_clouds(b, clouds, FIRST)
    b.guess.publish(pose_message(Odometry, np.eye(4), FIRST, 'odom', 'base_link'))
    b.until(lambda: b.statuses('refused'))
    assert "'odom'" in b.statuses('refused')[0].message


def test_guess_between_two_messages_is_interpolated(bench, clouds):
    b = bench().start()
    publish_clouds(b, clouds, FIRST)
    ends = np.eye(4), T_TRUTH
    b.guess.publish(guess_message(ends[0], FIRST - 25 * MS))
    b.guess.publish(guess_message(ends[1], FIRST + 75 * MS))
    expected = register(*clouds, interpolated(*ends, 0.25)).T_target_source
    np.testing.assert_allclose(matrix_of(b.transform_of(FIRST)), expected, rtol=0, atol=1e-9)


def test_guesses_too_old_are_refused_until_the_limit_is_raised(bench, clouds):
    b = bench().start()
    publish_clouds(b, clouds, FIRST)
    for shift in (-2 * SECOND, 2 * SECOND):
        b.guess.publish(guess_message(np.eye(4), FIRST + shift))
    b.until(lambda: b.statuses('refused'))
    (status,) = b.statuses('refused')
    assert 'is 2 s off; initial_guess.max_age is 1 s' in status.message
    (result,) = b.node.set_parameters([Parameter('initial_guess.max_age', value=3.0)])
    assert result.successful
    b.source.publish(cloud_message(clouds[1], FIRST + 100 * MS, 'lidar'))
    b.transform_of(FIRST + 100 * MS)


def test_type_of_the_guess_may_change_while_it_runs(bench, clouds):
    b = bench().start()
    publish_clouds(b, clouds, FIRST)
    b.until(lambda: b.node.registration.inputs.pairing.waiting == 1)
    (result,) = b.node.set_parameters([Parameter('initial_guess.type', value='odometry')])
    assert result.successful
    # one process has one type on a topic only, and here the publisher of the other one is in it
    b.until(lambda: b.statuses('waiting'))
    assert 'cannot be subscribed to' in b.statuses('waiting')[-1].message
    b.other.destroy_publisher(b.guess)
    odometry = b.other.create_publisher(Odometry, '/idem_node/initial_guess', 10)
    b.until(odometry.get_subscription_count)
    odometry.publish(pose_message(Odometry, np.eye(4), FIRST))
    b.transform_of(FIRST)
    (result,) = b.node.set_parameters([Parameter('initial_guess.type', value='identity')])
    assert result.successful
    assert set(b.node.registration.inputs.subscriptions.held) == {'target', 'source', 'imu'}
    publish_clouds(b, clouds, FIRST + 100 * MS)
    b.transform_of(FIRST + 100 * MS)


@pytest.mark.skipif(find_spec('tf2_msgs') is not None, reason='tf2_msgs is installed here')
def test_change_to_tf_without_its_messages_is_refused_with_the_package_to_install(bench, clouds):
    b = bench().start()
    (result,) = b.node.set_parameters([Parameter('initial_guess.type', value='tf')])
    assert not result.successful
    assert 'apt install ros-jazzy-tf2-msgs' in result.reason
    send(b, clouds, FIRST)
    b.transform_of(FIRST)


@pytest.mark.parametrize('name', ['identity', 'last'])
def test_guess_that_no_topic_need_give_is_not_waited_for(bench, clouds, name):
    b = bench(guess_type=name, guess_class=None).start()
    assert ('initial_guess' in b.node.registration.inputs.subscriptions.held) == (name == 'last')
    for stamp in (FIRST, FIRST + 100 * MS):
        publish_clouds(b, clouds, stamp)
        np.testing.assert_allclose(matrix_of(b.transform_of(stamp)), T_TRUTH, rtol=0, atol=0.02)


def test_last_result_is_where_the_next_one_starts(bench, clouds):
    b = bench(guess_type='last', guess_class=None).start()
    publish_clouds(b, clouds, FIRST)
    b.transform_of(FIRST)
    first = register(*clouds, np.eye(4)).T_target_source
    publish_clouds(b, clouds, FIRST + 100 * MS)
    expected = register(*clouds, first).T_target_source
    second = matrix_of(b.transform_of(FIRST + 100 * MS))
    np.testing.assert_allclose(second, expected, rtol=0, atol=1e-9)


def test_pose_of_long_ago_on_the_topic_is_where_the_first_one_starts(bench, clouds):
    b = bench(guess_type='last').start()
    guess = T_TRUTH @ exp(np.array([0.0, 0.0, 0.01, 0.05, 0.0, 0.0]))
    b.guess.publish(guess_message(guess, 5))
    b.until(lambda: b.node.registration.inputs.pairing._guesses._first)
    publish_clouds(b, clouds, FIRST)
    expected = register(*clouds, guess).T_target_source
    np.testing.assert_allclose(matrix_of(b.transform_of(FIRST)), expected, rtol=0, atol=1e-9)


@pytest.mark.skipif(find_spec('tf2_msgs') is not None, reason='tf2_msgs is installed here')
def test_tf_without_its_messages_ends_the_start_with_the_package_to_install(bench):
    with pytest.raises(InvalidConfig, match='apt install ros-jazzy-tf2-msgs'):
        bench(guess_type='tf', guess_class=None).start()


@pytest.fixture
def tf_bench(bench, monkeypatch):
    """A node that listens to tf, where no package has its messages: they are handed to it."""
    class_of = subscriptions._class_of
    monkeypatch.setattr(
        subscriptions,
        '_class_of',
        lambda msgtype, kind: Odometry if 'tf2_msgs' in msgtype else class_of(msgtype, kind),
    )
    return bench(guess_type='tf', guess_class=None).start()


def test_guess_from_tf_is_the_way_from_source_to_target_at_the_stamp(tf_bench, clouds):
    b = tf_bench
    publish_clouds(b, clouds, FIRST)
    b.until(lambda: b.statuses('waiting') and 'lidar' in b.statuses('waiting')[-1].message)
    text = b.statuses('waiting')[-1].message
    assert text.startswith('waiting for initial_guess (/tf has 0 publishers, /tf_static has 0')
    assert "tf does not connect the source frame 'lidar' with the target frame 'map'" in text
    b.node.registration.inputs.subscriptions.held['tf_static'][0].callback(
        poses.tf(guess_message(np.eye(4), 0, 'base', 'lidar'))
    )
    for shift in (-50 * MS, 50 * MS):
        moving = guess_message(np.eye(4), FIRST + shift, 'map', 'base')
        b.node.registration.inputs.subscriptions.held['tf'][0].callback(poses.tf(moving))
    np.testing.assert_allclose(matrix_of(b.transform_of(FIRST)), T_TRUTH, rtol=0, atol=0.02)


def test_transform_that_tf_lacks_is_a_refusal_with_the_frames_named(tf_bench, clouds):
    b = tf_bench
    publish_clouds(b, clouds, FIRST)
    publish_clouds(b, clouds, FIRST + 100 * MS)
    b.until(lambda: b.statuses('refused'))
    assert "'lidar' with the target frame 'map'" in b.statuses('refused')[0].message
    assert b.received['transform'] == []


def test_tf_is_subscribed_as_tf2_does(tf_bench):
    qualities = {}
    for topic in ('/tf', '/tf_static'):
        (info,) = tf_bench.node.get_subscriptions_info_by_topic(topic)
        quality = info.qos_profile
        qualities[topic] = quality.reliability.name, quality.durability.name
    assert qualities == {
        '/tf': ('RELIABLE', 'VOLATILE'),
        '/tf_static': ('RELIABLE', 'TRANSIENT_LOCAL'),
    }


def test_nearest_target_is_refused_beyond_the_tolerance(bench, clouds):
    b = bench(guess_type='identity', guess_class=None, pairing='nearest').start()
    publish_clouds(b, clouds, FIRST)
    b.target.publish(cloud_message(clouds[0], FIRST + 90 * MS, 'map'))
    b.transform_of(FIRST)
    b.source.publish(cloud_message(clouds[1], FIRST + 200 * MS, 'lidar'))
    b.target.publish(cloud_message(clouds[0], FIRST + 900 * MS, 'map'))
    b.until(lambda: b.statuses('refused'))
    assert 'pairing_tolerance is 0.05 s' in b.statuses('refused')[0].message


def test_repeated_and_late_sources_are_each_answered(bench, clouds):
    b = bench().start()
    for i, shift in enumerate((100, 0, 0)):
        send(b, clouds, FIRST + shift * MS)
        b.until(lambda count=i + 1: len(b.received['transform']) == count)
    stamps = [stamp_ns(message) for message in b.received['transform']]
    assert stamps == [FIRST + 100 * MS, FIRST, FIRST]
    assert b.statuses('clock_set_back') == []


def test_a_guess_is_found_among_hundreds_of_other_frames_and_other_times(bench, clouds):
    b = bench().start()
    publish_clouds(b, clouds, FIRST)
    for i in range(300):
        stamp = FIRST + i * MS + (1 - 2 * (i % 2)) * 3600 * SECOND
        b.guess.publish(guess_message(np.eye(4), stamp))
        b.guess.publish(guess_message(np.eye(4), FIRST + i, 'here', 'there'))
    send(b, clouds, FIRST + 100 * MS)
    b.transform_of(FIRST + 100 * MS)


def test_recording_in_a_loop_is_said_in_diagnostics_and_answered_again(bench, clouds):
    b = bench().start()
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    send(b, clouds, FIRST - 10 * SECOND)
    b.transform_of(FIRST - 10 * SECOND)
    b.until(lambda: b.statuses('clock_set_back'))
    (status,) = b.statuses('clock_set_back')
    assert status.level == DiagnosticStatus.WARN
    assert 'the clock was set back by 10 s' in status.message
    assert values(status)['clock_jumps'] == '1'


def test_simulated_clock_that_is_set_back_clears_the_buffers(bench, clouds):
    b = bench(use_sim_time=True).start()
    clock = b.other.create_publisher(Clock, '/clock', 10)
    b.until(lambda: b.statuses('waiting'))
    assert '/clock has not come' in b.statuses('waiting')[0].message
    b.until(clock.get_subscription_count)

    def turn_to(stamp):
        clock.publish(Clock(clock=time_message(stamp)))
        b.until(lambda: b.node.get_clock().now().nanoseconds == stamp)

    turn_to(FIRST)
    b.source.publish(cloud_message(clouds[1], FIRST, 'lidar'))
    b.until(lambda: b.node.registration.inputs.pairing.waiting == 1)
    turn_to(FIRST - 10 * SECOND)
    assert (
        b.node.registration.inputs.pairing.waiting,
        b.node.registration.inputs.pairing.dropped,
    ) == (0, 1)
    b.until(lambda: b.statuses('clock_set_back'))
    send(b, clouds, FIRST - 9 * SECOND)
    b.transform_of(FIRST - 9 * SECOND)
    assert values(b.statuses('clock_set_back')[-1])['clock_jumps'] == '1'


def test_messages_that_dds_lost_are_told_by_their_input(bench):
    b = bench().start()
    handlers = b.node.registration.inputs.subscriptions.held['target'][0].event_handlers
    lost = QoSSubscriptionEventType.RCL_SUBSCRIPTION_MESSAGE_LOST
    (handler,) = [each for each in handlers if each.event_type == lost]
    handler.callback(SimpleNamespace(total_count_change=3))
    b.until(lambda: any(values(each)['target_lost'] == '3' for each in b.loads()))
    assert '3 messages were lost on the way' in b.loads()[-1].message
