"""ROS messages for recordings, made without ROS."""

from functools import cache

import numpy as np
from rosbags.typesys import Stores, get_typestore

from idem_ros.messages.pointcloud2 import pack_points
from idem_ros.messages.transform_message import sec_and_nanosec, translation_and_quaternion

CLOUD = 'sensor_msgs/msg/PointCloud2'
TRANSFORM = 'geometry_msgs/msg/TransformStamped'
DIAGNOSTICS = 'diagnostic_msgs/msg/DiagnosticArray'


@cache
def typestore():
    """Return the message types of ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


def cloud_message(points, stamp, frame_id, dtype=np.float32):
    """Return a sensor_msgs/PointCloud2 of (N, 3) points; `stamp` in nanoseconds."""
    packed = pack_points(points, dtype)
    field = _type('sensor_msgs/msg/PointField')
    return _type(CLOUD)(
        header=header(stamp, frame_id),
        **packed.layout,
        fields=[field(*values) for values in packed.fields],
        data=packed.data,
    )


def transform_message(transform, stamp, frame_id, child_frame_id, decimals=None):
    """Return a geometry_msgs/TransformStamped of a (4, 4) transform: child frame in frame.

    With `decimals`, its translation and its quaternion are rounded to as many.
    """
    translation, quaternion = translation_and_quaternion(transform)
    if decimals is not None:
        translation, quaternion = np.round(translation, decimals), np.round(quaternion, decimals)
    return _type(TRANSFORM)(
        header=header(stamp, frame_id),
        child_frame_id=child_frame_id,
        transform=_type('geometry_msgs/msg/Transform')(
            translation=_type('geometry_msgs/msg/Vector3')(*translation),
            rotation=_type('geometry_msgs/msg/Quaternion')(*quaternion),
        ),
    )


def diagnostics_message(node, task, level, text, values, stamp):
    """Return a diagnostic_msgs/DiagnosticArray with one status.

    Args:
        node: fully qualified name of the one that reports.
        task: what of it the status is of.
        level: 0 (OK), 1 (WARN) or 2 (ERROR).
        text: the status in a sentence.
        values: {key: value}, both strings.
        stamp: [ns].
    """
    key_value = _type('diagnostic_msgs/msg/KeyValue')
    status = _type('diagnostic_msgs/msg/DiagnosticStatus')(
        level=level,
        name=f'{node}: {task}',
        message=text,
        hardware_id=node,
        values=[key_value(key, value) for key, value in values.items()],
    )
    return _type(DIAGNOSTICS)(header=header(stamp, ''), status=[status])


def header(stamp, frame_id):
    """Return a std_msgs/Header; see `transform_message.sec_and_nanosec` of `stamp` [ns]."""
    seconds, nanoseconds = sec_and_nanosec(stamp)
    time = _type('builtin_interfaces/msg/Time')(sec=seconds, nanosec=nanoseconds)
    return _type('std_msgs/msg/Header')(stamp=time, frame_id=frame_id)


def _type(name):
    return typestore().types[name]
