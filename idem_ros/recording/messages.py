"""ROS messages for recordings, made without ROS; recorded ones as the bytes ROS 2 sends."""

from functools import cache

import numpy as np
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.building import CLOUD, Messages
from idem_ros.messages.transform_message import stamp_ns


@cache
def typestore():
    """Return the message types of ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


_RECORDED = Messages(lambda msgtype: typestore().types[msgtype])
cloud_message, transform_message = _RECORDED.cloud, _RECORDED.transform
diagnostics_message, header = _RECORDED.diagnostics, _RECORDED.header


def tf_message(transforms):
    """Return a tf2_msgs/TFMessage of TransformStamped messages."""
    return typestore().types['tf2_msgs/msg/TFMessage'](transforms=list(transforms))


def recorded_cloud(message):
    """Return a PointCloud2 of rclpy or of rosbags as one that can be recorded, whole."""
    types, names = typestore().types, ('name', 'offset', 'datatype', 'count')
    field = types['sensor_msgs/msg/PointField']
    return types[CLOUD](
        header=header(stamp_ns(message), message.header.frame_id),
        height=message.height,
        width=message.width,
        fields=[field(**{name: getattr(each, name) for name in names}) for each in message.fields],
        is_bigendian=message.is_bigendian,
        point_step=message.point_step,
        row_step=message.row_step,
        data=np.frombuffer(message.data, np.uint8),
        is_dense=message.is_dense,
    )


class NotSendable(IdemError):
    """A recorded message that ROS 2 Jazzy has no type for, or another one of the same name."""


def is_known(msgtype):
    """Return whether ROS 2 Jazzy's own packages define a message type."""
    return msgtype in typestore().types


def to_cdr(message):
    """Return a message that was read from a recording as ROS 2 CDR bytes.

    Raises:
        NotSendable: the recorded definition differs from Jazzy's.
    """
    try:
        return bytes(typestore().serialize_cdr(message, message.__msgtype__))
    except (KeyError, AttributeError, TypeError, ValueError, SerdeError) as error:
        raise NotSendable(
            f'{message.__msgtype__} was recorded with fields other than those of ROS 2 Jazzy: '
            f'{type(error).__name__}: {error}'
        ) from error
