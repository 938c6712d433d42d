"""ROS messages from numbers, of the classes of rclpy or of rosbags: one way for both."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from idem_ros.messages.pointcloud2 import pack_points
from idem_ros.messages.transform_message import sec_and_nanosec, translation_and_quaternion

CLOUD = 'sensor_msgs/msg/PointCloud2'
TRANSFORM = 'geometry_msgs/msg/TransformStamped'
DIAGNOSTICS = 'diagnostic_msgs/msg/DiagnosticArray'


@dataclass(frozen=True)
class Messages:
    """Makes messages; every number is made a Python number first.

    ROS 2 Jazzy does not check field types: an int or a numpy scalar in a float field is sent as
    garbage without a word.
    """

    class_of: Callable[[str], Any]
    """Gives the class of a type such as 'sensor_msgs/msg/PointCloud2'."""
    octets: Callable[[np.ndarray], Any] = np.asarray
    """Makes of (N,) uint8 what a field of bytes takes."""
    octet: Callable[[int], Any] = int
    """Makes of a small number what a field of one byte takes."""

    def time(self, stamp):
        """Return a builtin_interfaces/Time; see `sec_and_nanosec` of `stamp` [ns]."""
        seconds, nanoseconds = sec_and_nanosec(stamp)
        return self.class_of('builtin_interfaces/msg/Time')(sec=seconds, nanosec=nanoseconds)

    def header(self, stamp, frame_id):
        """Return a std_msgs/Header; `stamp` in nanoseconds."""
        frame = str(frame_id)
        return self.class_of('std_msgs/msg/Header')(stamp=self.time(stamp), frame_id=frame)

    def cloud(self, points, stamp, frame_id, dtype: type = np.float32, columns=None):
        """Return a sensor_msgs/PointCloud2 of (N, 3) points; `stamp` in nanoseconds.

        Of `columns`, {name: (N,)}, are more fields; all are of `dtype`, and RViz asks for float32.
        """
        packed = pack_points(points, dtype, columns)
        field = self.class_of('sensor_msgs/msg/PointField')
        return self.class_of(CLOUD)(
            header=self.header(stamp, frame_id),
            **packed.layout,
            fields=[
                field(name=name, offset=offset, datatype=datatype, count=count)
                for name, offset, datatype, count in packed.fields
            ],
            data=self.octets(packed.data),
        )

    def transform(self, transform, stamp, frame_id, child_frame_id, decimals=None):
        """Return a geometry_msgs/TransformStamped of a (4, 4) transform: child frame in frame.

        With `decimals`, its translation and its quaternion are rounded to as many.
        """
        translation, rotation = self.position(transform, 'Vector3', decimals)
        return self.class_of(TRANSFORM)(
            header=self.header(stamp, frame_id),
            child_frame_id=str(child_frame_id),
            transform=self.class_of('geometry_msgs/msg/Transform')(
                translation=translation, rotation=rotation
            ),
        )

    def position(self, transform, kind, decimals=None):
        """Return (Vector3 or Point, as `kind` says, and Quaternion) of a (4, 4) transform."""
        numbers = translation_and_quaternion(transform)
        if decimals is not None:
            numbers = (np.round(each, decimals) for each in numbers)
        (x, y, z), (qx, qy, qz, qw) = (map(float, each) for each in numbers)
        return (
            self.class_of(f'geometry_msgs/msg/{kind}')(x=x, y=y, z=z),
            self.class_of('geometry_msgs/msg/Quaternion')(x=qx, y=qy, z=qz, w=qw),
        )

    def diagnostics(self, node, task, level, text, values, stamp):
        """Return a diagnostic_msgs/DiagnosticArray with one status.

        Args:
            node: fully qualified name of the one that reports, as aggregators tell two apart.
            task: what of it the status is of.
            level: 0 (OK), 1 (WARN), 2 (ERROR) or 3 (STALE).
            text: the status in words, with the reason where something was refused.
            values: {key: value}, as `diagnostics.refinement_values` gives them.
            stamp: [ns].
        """
        key_value = self.class_of('diagnostic_msgs/msg/KeyValue')
        status = self.class_of('diagnostic_msgs/msg/DiagnosticStatus')(
            level=self.octet(level),
            name=f'{node}: {task}',
            message=str(text),
            hardware_id=str(node),
            values=[key_value(key=str(key), value=str(value)) for key, value in values.items()],
        )
        return self.class_of(DIAGNOSTICS)(header=self.header(stamp, ''), status=[status])
