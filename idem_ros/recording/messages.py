"""ROS messages for recordings, made without ROS."""

from functools import cache

from rosbags.typesys import Stores, get_typestore

from idem_ros.messages.building import Messages


@cache
def typestore():
    """Return the message types of ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


_RECORDED = Messages(lambda msgtype: typestore().types[msgtype])
cloud_message, transform_message = _RECORDED.cloud, _RECORDED.transform
diagnostics_message, header = _RECORDED.diagnostics, _RECORDED.header
