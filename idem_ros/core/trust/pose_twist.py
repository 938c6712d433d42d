"""From a twist about the target's origin to the source frame's pose, in the order of ROS."""

import numpy as np

from idem_ros.core.arrays import Floats, Matrix6, Point
from idem_ros.core.geometry import se3


def to_pose(position: Point) -> Matrix6:
    """Return (6, 6): a twist (omega, v) to x y z rx ry rz of the source frame's pose.

    Its origin, at a position (3,) in the target frame, moves by v + omega x position.
    """
    moved = np.eye(6)
    moved[3:, :3] = -se3.skew(position)
    return moved[se3.ROS_ORDER]


def pose_covariance(covariance: Matrix6, position: Point) -> Matrix6:
    """Return the (6, 6) covariance of the pose, given that of the twist."""
    moved = to_pose(position)
    of_pose: Matrix6 = moved @ covariance @ moved.T
    return of_pose


def sweep_covariance(covariance: Floats, position: Point) -> Floats | None:
    """Return the (12, 12) covariance of pose and twist of a sweep, given that of `to_pose`'s.

    None of a (6, 6) one: there is no twist.
    """
    if len(covariance) == 6:
        return None
    moved = np.eye(12)
    moved[:6, :6] = to_pose(position)
    return moved @ covariance @ moved.T
