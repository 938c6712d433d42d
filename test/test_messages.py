import pytest
from live import rclpy  # noqa: F401  (before the messages, so that they check their fields)

# isort: split
import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Float64

from idem_ros.core import RegistrationResult, Status
from idem_ros.core.se3 import exp
from idem_ros.node.messages import (
    diagnostics_message,
    q_tot_message,
    time_message,
    transform_message,
)
from idem_ros.refinement import Refinement
from idem_ros.transform_message import matrix_of

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
    'level',
    [DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.STALE],
)
def test_diagnostics_keep_level_text_and_values(level):
    values = {'q_tot': np.float64(1.5), 'dropped': 3}
    message = sent(diagnostics_message('node: task', level, 'so it is', values, STAMP))
    (status,) = message.status
    assert (status.name, status.level, status.message) == ('node: task', level, 'so it is')
    assert {each.key: each.value for each in status.values} == {'q_tot': '1.5', 'dropped': '3'}


@pytest.mark.parametrize('stamp', [0, 1, STAMP, -1, 2**31 * 10**9 - 1])
def test_stamps_come_back_to_the_nanosecond(stamp):
    message = sent(time_message(stamp))
    assert message.sec * 10**9 + message.nanosec == stamp
