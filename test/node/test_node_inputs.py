"""The node in this process: guesses of every type, pairing by stamps, clocks that are set back."""

from types import SimpleNamespace

import pytest
from node_bench import FIRST, MS, T_TRUTH, cloud_message, guess_message, publish_clouds, send

# isort: split
import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.event_handler import QoSSubscriptionEventType
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from idem_ros.core import register
from idem_ros.core.geometry.se3 import exp
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.node.messages import time_message
from idem_ros.pairing.stamped_poses import interpolated

SECOND = 1000 * MS


def values(status):
    return {each.key: each.value for each in status.values}


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
