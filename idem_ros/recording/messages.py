"""ROS messages for recordings, made without ROS."""

from functools import cache

import numpy as np
from rosbags.typesys import Stores, get_typestore

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
