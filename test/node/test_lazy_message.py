"""Messages of which only the header is read until more is asked for."""

import pytest
from live import rclpy  # noqa: F401  (before the messages, so that they check fields)

# isort: split
import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry
from node_bench import guess_message
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64

from idem_ros.messages.transform_message import covariance_of, matrix_of, stamp_ns
from idem_ros.node.lazy_message import UnreadableMessage, begins_with_header, unread_of

KINDS = [TransformStamped, PoseWithCovarianceStamped, Odometry, Imu]


def filled(kind, frame='map'):
    message = kind()
    message.header.stamp.sec, message.header.stamp.nanosec = -5, 123_456_789
    message.header.frame_id = frame
    if hasattr(message, 'child_frame_id'):
        message.child_frame_id = 'lidar ü'
    return message


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('frame', ['', 'm', 'map', 'maps', 'é' * 50])
def test_its_head_is_that_of_the_message(kind, frame):
    message = filled(kind, frame)
    unread = unread_of(kind)(serialize_message(message))
    assert stamp_ns(unread) == stamp_ns(message)
    assert unread.header.frame_id == frame
    assert getattr(unread, 'child_frame_id', None) == getattr(message, 'child_frame_id', None)
    assert unread._message is None or not hasattr(message, 'child_frame_id')


def test_its_other_fields_are_read_when_they_are_asked_for():
    T = np.eye(4)
    T[:3, 3] = 1.0, 2.0, 3.0
    guess = unread_of(TransformStamped)(serialize_message(guess_message(T, 5)))
    np.testing.assert_array_equal(matrix_of(guess), T)
    assert not hasattr(guess, 'pose')
    pose = filled(PoseWithCovarianceStamped)
    pose.pose.covariance[7] = 4.0
    unread = unread_of(PoseWithCovarianceStamped)(serialize_message(pose))
    assert covariance_of(unread)[1, 1] == 4.0


def test_bytes_of_the_other_order_are_read_whole():
    swapped = b'\x00\x00\x00\x00' + (7).to_bytes(4, 'big') + (9).to_bytes(4, 'big')
    for text in (b'map\x00', b'abc\x00'):
        swapped += (4).to_bytes(4, 'big') + text
    swapped += np.array([0, 0, 0, 0, 0, 0, 1], '>f8').tobytes()
    guess = unread_of(TransformStamped)(swapped)
    assert (stamp_ns(guess), guess.header.frame_id) == (7 * 10**9 + 9, 'map')
    assert guess.child_frame_id == 'abc'


@pytest.mark.parametrize('size', [0, 3, 4, 15, 16, 18, 21, 30])
def test_bytes_that_hold_no_head_are_refused(size):
    whole = serialize_message(filled(TransformStamped))
    with pytest.raises(UnreadableMessage):
        unread_of(TransformStamped)(whole[:size])


def test_bytes_that_end_after_the_head_are_refused_when_more_is_asked_for():
    whole = serialize_message(filled(TransformStamped))
    guess = unread_of(TransformStamped)(whole[:50])
    assert guess.child_frame_id == 'lidar ü'
    with pytest.raises(UnreadableMessage):
        matrix_of(guess)


def test_what_does_not_begin_with_a_header_is_told():
    assert not begins_with_header(Float64)
    assert all(map(begins_with_header, KINDS))
