"""What the commands need that work on live topics."""

from idem_ros.core.exceptions import IdemError


class RclpyMissing(IdemError):
    """A command that works on live topics, where ROS 2 is not installed."""


def require_rclpy(program):
    """Raise `RclpyMissing` with what to install, unless rclpy and its messages can be imported.

    Args:
        program: who asks, such as 'idem play'.
    """
    try:
        import diagnostic_msgs.msg  # noqa: F401
        import rclpy  # noqa: F401
        import rosgraph_msgs.msg  # noqa: F401
        import sensor_msgs.msg  # noqa: F401
    except ImportError as error:
        raise RclpyMissing(
            f'{program} works on live ROS 2 topics and needs rclpy ({error}): '
            'source an installed Jazzy (. /opt/ros/jazzy/setup.sh), or install '
            '"ros-jazzy-rclpy[fastrtps]" and ros-jazzy-common-interfaces with pip'
        ) from error
