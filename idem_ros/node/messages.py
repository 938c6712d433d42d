"""What the node publishes, as ROS messages; every number is made a Python number first.

ROS 2 Jazzy does not check field types: an int or a numpy scalar in a float field is sent as
garbage without a word.
"""

from importlib import import_module

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import Float64

from idem_ros.refinement import Refinement
from idem_ros.transform_message import translation_and_quaternion


def transform_message(refinement: Refinement) -> TransformStamped:
    """Return the refined pose: source frame in target frame, at the source cloud's stamp."""
    translation, quaternion = translation_and_quaternion(refinement.result.T_target_source)
    message = TransformStamped()
    message.header.stamp = time_message(refinement.stamp)
    message.header.frame_id = str(refinement.target_frame)
    message.child_frame_id = str(refinement.source_frame)
    t, q = message.transform.translation, message.transform.rotation
    t.x, t.y, t.z = map(float, translation)
    q.x, q.y, q.z, q.w = map(float, quaternion)
    return message


def q_tot_message(refinement: Refinement) -> Float64:
    """Return q_tot at the refined pose."""
    return Float64(data=float(refinement.result.q_tot))


def diagnostics_message(
    name: str, level: bytes, text: str, values: dict[str, str], stamp: int
) -> DiagnosticArray:
    """Return one status in a DiagnosticArray.

    Args:
        name: of the component that reports.
        level: `DiagnosticStatus.OK`, `WARN`, `ERROR` or `STALE` (of type bytes in rclpy).
        text: the status in words, with the reason where something was refused.
        values: what is known, as `idem_ros.diagnostics.refinement_values` gives it.
        stamp: [ns].
    """
    status = DiagnosticStatus(level=level, name=str(name), message=str(text))
    status.values = [KeyValue(key=str(key), value=str(value)) for key, value in values.items()]
    message = DiagnosticArray(status=[status])
    message.header.stamp = time_message(stamp)
    return message


def time_message(stamp: int) -> Time:
    """Return a stamp [ns] as a ROS message."""
    seconds, nanoseconds = divmod(int(stamp), 10**9)
    return Time(sec=seconds, nanosec=nanoseconds)


def message_class(msgtype: str) -> type:
    """Return rclpy's class of a type such as 'sensor_msgs/msg/PointCloud2'.

    Raises:
        ImportError: its package is not installed, or has no such message.
    """
    package, _, name = msgtype.split('/')
    try:
        return getattr(import_module(f'{package}.msg'), name)
    except AttributeError as error:
        raise ImportError(f'{package} has no message {name}') from error
