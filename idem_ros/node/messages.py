"""What the node publishes, as ROS messages."""

import array
from importlib import import_module

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid
from numpy.typing import NDArray
from std_msgs.msg import Float64

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.messages.building import Messages
from idem_ros.refinement.debug_clouds import QTotSlice
from idem_ros.refinement.outcome import Refinement

UNKNOWN_VARIANCE = 1e6  # [m2] and [rad2]: a filter that takes it gives the pose no weight


def transform_message(refinement: Refinement) -> TransformStamped:
    """Return the refined pose: source frame in target frame, at the instant that it is of."""
    T, frames = (
        refinement.result.T_target_source,
        (refinement.target_frame, refinement.source_frame),
    )
    return LIVE.transform(T, refinement.instant, *frames)


def pose_message(refinement: Refinement, covariance: NDArray | None) -> PoseWithCovarianceStamped:
    """Return the refined pose of the source frame in the target frame, with a covariance.

    Args:
        refinement: gives frames, stamp and pose.
        covariance: see `covariance_field`.
    """
    message = PoseWithCovarianceStamped(
        header=LIVE.header(refinement.instant, refinement.target_frame)
    )
    pose = message.pose.pose
    pose.position, pose.orientation = LIVE.position(refinement.result.T_target_source, 'Point')
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


def grid_message(refinement: Refinement, slice_: QTotSlice) -> OccupancyGrid:
    """Return a slice of q_tot as a grid of where the origin of the source frame would be."""
    low, high = float(slice_.q_tot.min()), float(slice_.q_tot.max())
    scaled = (slice_.q_tot - low) * (100.0 / (high - low) if high > low else 0.0)
    message = OccupancyGrid(data=array.array('b', np.rint(scaled).astype(np.int8).tobytes()))
    message.header = LIVE.header(refinement.instant, refinement.target_frame)
    message.info.map_load_time = message.header.stamp
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


LIVE = Messages(
    message_class,
    octets=lambda data: array.array('B', data.tobytes()),  # of bytes it is copied one by one
    octet=lambda number: bytes([number]),
)
cloud_message, diagnostics_message, time_message = LIVE.cloud, LIVE.diagnostics, LIVE.time
