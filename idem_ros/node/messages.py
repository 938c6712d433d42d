"""What the node publishes, as ROS messages; every number is made a Python number first.

ROS 2 Jazzy does not check field types: an int or a numpy scalar in a float field is sent as
garbage without a word.
"""

import array
from importlib import import_module

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Float64

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.messages.pointcloud2 import pack_points
from idem_ros.messages.transform_message import sec_and_nanosec, translation_and_quaternion
from idem_ros.refinement.q_tot_slice import QTotSlice
from idem_ros.refinement.refiner import Refinement

UNKNOWN_VARIANCE = 1e6  # [m2] and [rad2]: a filter that takes it gives the pose no weight


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


def pose_message(refinement: Refinement, covariance: NDArray | None) -> PoseWithCovarianceStamped:
    """Return the refined pose of the source frame in the target frame, with a covariance.

    Args:
        refinement: gives frames, stamp and pose.
        covariance: see `covariance_field`.
    """
    translation, quaternion = translation_and_quaternion(refinement.result.T_target_source)
    message = PoseWithCovarianceStamped()
    message.header.stamp = time_message(refinement.stamp)
    message.header.frame_id = str(refinement.target_frame)
    p, q = message.pose.pose.position, message.pose.pose.orientation
    p.x, p.y, p.z = map(float, translation)
    q.x, q.y, q.z, q.w = map(float, quaternion)
    message.pose.covariance = covariance_field(covariance)
    return message


def covariance_field(covariance: NDArray | None) -> NDArray:
    """Return the 36 numbers of a covariance as ROS orders them.

    Args:
        covariance: (6, 6) of x, y, z [m] and rotations about the fixed axes x, y, z [rad]; None:
            not known, which is a variance of 1e6 of each and no correlation.
    """
    if covariance is None:
        covariance = UNKNOWN_VARIANCE * np.eye(6)
    return np.ascontiguousarray(covariance, dtype=np.float64).reshape(36)


def cloud_message(
    points: NDArray, stamp: int, frame_id: str, columns: dict[str, NDArray] | None = None
) -> PointCloud2:
    """Return points (N, 3) as a cloud of float32, which RViz asks for.

    Args:
        points: (N, 3), finite.
        stamp: [ns].
        frame_id: of the points.
        columns: {name: (N,)}, more fields.
    """
    packed = pack_points(points, np.float32, columns)
    message = PointCloud2(
        **packed.layout,
        fields=[
            PointField(name=name, offset=offset, datatype=datatype, count=count)
            for name, offset, datatype, count in packed.fields
        ],
        data=array.array('B', packed.data.tobytes()),  # of bytes it is copied one by one
    )
    message.header.stamp = time_message(stamp)
    message.header.frame_id = str(frame_id)
    return message


def grid_message(refinement: Refinement, slice_: QTotSlice) -> OccupancyGrid:
    """Return a slice of q_tot as a grid of where the origin of the source frame would be."""
    low, high = float(slice_.q_tot.min()), float(slice_.q_tot.max())
    scaled = (slice_.q_tot - low) * (100.0 / (high - low) if high > low else 0.0)
    message = OccupancyGrid(data=array.array('b', np.rint(scaled).astype(np.int8).tobytes()))
    message.header.stamp = message.info.map_load_time = time_message(refinement.stamp)
    message.header.frame_id = str(refinement.target_frame)
    message.info.resolution = float(slice_.step)
    message.info.height, message.info.width = map(int, slice_.q_tot.shape)
    corner = refinement.result.T_target_source[:3, 3].copy()
    corner[:2] += slice_.shifts[0] - slice_.step / 2
    origin = message.info.origin.position
    origin.x, origin.y, origin.z = map(float, corner)
    return message


def q_tot_message(refinement: Refinement) -> Float64:
    """Return q_tot at the refined pose."""
    return Float64(data=float(refinement.result.q_tot))


def diagnostics_message(
    node: str, task: str, level: bytes, text: str, values: dict[str, str], stamp: int
) -> DiagnosticArray:
    """Return one status in a DiagnosticArray.

    Args:
        node: fully qualified name of the one that reports, as aggregators tell two apart.
        task: what of it the status is of.
        level: `DiagnosticStatus.OK`, `WARN`, `ERROR` or `STALE` (of type bytes in rclpy).
        text: the status in words, with the reason where something was refused.
        values: what is known, as `idem_ros.refinement.diagnostics.refinement_values` gives it.
        stamp: [ns].
    """
    status = DiagnosticStatus(
        level=level, name=f'{node}: {task}', hardware_id=str(node), message=str(text)
    )
    status.values = [KeyValue(key=str(key), value=str(value)) for key, value in values.items()]
    message = DiagnosticArray(status=[status])
    message.header.stamp = time_message(stamp)
    return message


def time_message(stamp: int) -> Time:
    """Return a stamp [ns] as a ROS message; see `transform_message.sec_and_nanosec`."""
    seconds, nanoseconds = sec_and_nanosec(stamp)
    return Time(sec=seconds, nanosec=nanoseconds)


def class_needed(msgtype: str, what: str) -> type:
    """Return rclpy's class of a type that something needs.

    Raises:
        InvalidConfig: it is not installed; begins with `what`, such as 'publish_tf is true'.
    """
    try:
        return message_class(msgtype)
    except ImportError as error:
        package = msgtype.partition('/')[0]
        raise InvalidConfig(
            f'{what}, which needs the ROS package {package}, and it is not installed: apt install '
            f'ros-jazzy-{package.replace("_", "-")} (PyPI has no wheel of it), or choose otherwise'
        ) from error


def message_class(msgtype: str) -> type:
    """Return rclpy's class of a type such as 'sensor_msgs/msg/PointCloud2' or '.../srv/Trigger'.

    Raises:
        ImportError: its package is not installed, or has no such message.
    """
    package, kind, name = msgtype.split('/')
    try:
        return getattr(import_module(f'{package}.{kind}'), name)
    except AttributeError as error:
        raise ImportError(f'{package} has no message {name}') from error
