"""A node of one's own around the library: the motion since the scan before, where it is usable.

python examples/own_node.py --ros-args -r points:=/velodyne_points
"""

from contextlib import suppress

import numpy as np
import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import PointCloud2

from idem_ros.core import Cloud, register, warm_up
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import translation_and_quaternion


class ScanOdometry(Node):
    """Each scan in the frame of the one before it, from the motion before."""

    def __init__(self, **options):
        super().__init__('scan_odometry', **options)
        warm_up()  # kernels are compiled before the first scan comes, not while it waits
        self._before, self._motion = None, np.eye(4)
        self._sent = self.create_publisher(TransformStamped, 'motion', 10)
        self.create_subscription(PointCloud2, 'points', self._on_scan, qos_profile_sensor_data)

    def _on_scan(self, message):
        scan = Cloud(read_points(message).points)
        if self._before is not None:
            result = register(self._before, scan, self._motion)
            if result.is_usable:
                self._motion = result.T_target_source
                self._sent.publish(_transform(message.header, self._motion))
            else:
                self.get_logger().warning(f'not sent on: {result.assessment.reason}')
        self._before = scan


def _transform(header, T):
    message = TransformStamped(header=header, child_frame_id=f'{header.frame_id}_now')
    t, q = message.transform.translation, message.transform.rotation
    (t.x, t.y, t.z), (q.x, q.y, q.z, q.w) = translation_and_quaternion(T)
    return message


def main():
    """Run until Ctrl-C."""
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(ScanOdometry())


if __name__ == '__main__':
    main()
