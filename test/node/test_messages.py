import pytest
from live import rclpy  # noqa: F401  (before the messages, so that they check their fields)

# isort: split
import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Float64

from idem_ros.core import InvalidConfig, RegistrationResult, Status
from idem_ros.core.geometry.se3 import exp
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import matrix_of
from idem_ros.node.messages import (
    class_needed,
    cloud_message,
    covariance_field,
    diagnostics_message,
    grid_message,
    pose_message,
    q_tot_message,
    time_message,
    transform_message,
)
from idem_ros.refinement import diagnostics
from idem_ros.refinement.debug_clouds import QTotSlice
from idem_ros.refinement.outcome import Refinement

STAMP = 1_700_000_000_123_456_789


@pytest.fixture
def refinement():
    result = RegistrationResult(
        T_target_source=exp(np.array([0.1, -0.2, 3.0, 1e3, -2.0, 0.5])),
        status=Status('converged'),
        iterations=np.int64(7),
        q_tot=np.float32(-1.5),
        q_mean=np.float64(-0.25),
        overlap=np.float64(0.5),
        radius=1,
        information=np.eye(6),
    )
    return Refinement(
        stamp=np.int64(STAMP),
        target_frame='map',
        source_frame=np.str_('lidar'),
        T_guess=np.eye(4),
        result=result,
        q_tot_before=0.0,
        time_ms=12.5,
        points_target=3,
        points_source=3,
        dropped_nonfinite=0,
        dropped_zero=0,
    )


def sent(message):
    return deserialize_message(serialize_message(message), type(message))


def test_fields_are_checked_in_these_tests():
    with pytest.raises(AssertionError):
        Float64(data='1.5')


def test_transform_says_where_the_source_frame_is_in_the_target_frame(refinement):
    message = sent(transform_message(refinement))
    assert (message.header.frame_id, message.child_frame_id) == ('map', 'lidar')
    assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == STAMP
    np.testing.assert_allclose(
        matrix_of(message), refinement.result.T_target_source, rtol=0, atol=1e-12
    )


def test_q_tot_survives_whatever_kind_of_number_it_is(refinement):
    assert sent(q_tot_message(refinement)).data == -1.5


@pytest.mark.parametrize(
    ('level', 'sent_as'),
    [
        (diagnostics.OK, DiagnosticStatus.OK),
        (diagnostics.WARN, DiagnosticStatus.WARN),
        (diagnostics.ERROR, DiagnosticStatus.ERROR),
        (diagnostics.STALE, DiagnosticStatus.STALE),
    ],
)
def test_diagnostics_keep_level_text_and_values(level, sent_as):
    values = {'q_tot': np.float64(1.5), 'dropped': 3}
    message = sent(diagnostics_message('/front/node', 'task', level, 'so it is', values, STAMP))
    (status,) = message.status
    assert (status.name, status.hardware_id) == ('/front/node: task', '/front/node')
    assert (status.level, status.message) == (sent_as, 'so it is')
    assert {each.key: each.value for each in status.values} == {'q_tot': '1.5', 'dropped': '3'}


@pytest.mark.parametrize('stamp', [0, 1, STAMP, -1, 2**31 * 10**9 - 1])
def test_stamps_come_back_to_the_nanosecond(stamp):
    message = sent(time_message(stamp))
    assert message.sec * 10**9 + message.nanosec == stamp


def test_pose_is_the_transform_and_of_an_unknown_covariance_where_none_is_given(refinement):
    message = sent(pose_message(refinement, None))
    assert message.header.frame_id == 'map'
    assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == STAMP
    np.testing.assert_allclose(
        matrix_of(message), refinement.result.T_target_source, rtol=0, atol=1e-12
    )
    np.testing.assert_array_equal(message.pose.covariance.reshape(6, 6), 1e6 * np.eye(6))


def test_covariance_is_sent_row_by_row(refinement):
    covariance = np.arange(36.0).reshape(6, 6)
    message = sent(pose_message(refinement, covariance))
    np.testing.assert_array_equal(message.pose.covariance, np.arange(36.0))
    np.testing.assert_array_equal(covariance_field(covariance.T[::-1]).shape, (36,))
    with pytest.raises(ValueError, match='reshape'):
        covariance_field(np.eye(3))


def test_cloud_comes_back_with_its_columns():
    points = np.array([[1.0, 2.0, 3.0], [-4.0, 5.5, 6.0]])
    message = sent(cloud_message(points, STAMP, 'map', columns={'q_i': np.array([0.25, -8.0])}))
    np.testing.assert_array_equal(read_points(message).points, points)
    assert [field.name for field in message.fields] == ['x', 'y', 'z', 'q_i']
    rows = np.frombuffer(message.data, '<f4').reshape(2, 4)
    np.testing.assert_array_equal(rows[:, 3], [0.25, -8.0])
    assert (message.header.frame_id, message.header.stamp.nanosec) == ('map', STAMP % 10**9)


@pytest.mark.parametrize(
    ('q', 'expected'),
    [([[-3.0, -1.0], [1.0, 5.0]], [0, 25, 50, 100]), ([[2.0, 2.0], [2.0, 2.0]], [0, 0, 0, 0])],
)
def test_grid_is_q_tot_from_0_to_100_where_the_source_would_be(refinement, q, expected):
    slice_ = QTotSlice(np.array([-0.5, 0.5]), np.array(q), voxel_size=0.1, radius=0.2)
    message = sent(grid_message(refinement, slice_))
    assert list(message.data) == expected
    assert (message.info.width, message.info.height, message.info.resolution) == (2, 2, 1.0)
    at = message.info.origin.position
    x, y, z = refinement.result.T_target_source[:3, 3]
    assert (at.x, at.y, at.z) == pytest.approx((x - 1.0, y - 1.0, z))
    assert message.info.origin.orientation.w == 1.0
    assert message.header.frame_id == 'map'


def test_messages_that_are_not_installed_are_named_with_their_package():
    with pytest.raises(InvalidConfig, match='^all is lost, which needs the ROS package no_msgs'):
        class_needed('no_msgs/msg/Nothing', 'all is lost')
