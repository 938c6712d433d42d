"""TransformStamped-like and pose messages to 4x4 matrices and back, stamps; imports no ROS."""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from idem_ros.core.arrays import LARGEST
from idem_ros.core.exceptions import InvalidTransform

LARGEST_NORM = 1e6
FIRST_STAMP, LAST_STAMP = -(2**31) * 10**9, 2**31 * 10**9 - 1  # [ns]: seconds are of type int32


def stamp_ns(message):
    """Return the header's stamp [ns] of a message."""
    stamp = message.header.stamp
    return stamp.sec * 10**9 + stamp.nanosec


def sec_and_nanosec(stamp):
    """Return the fields sec and nanosec of a stamp [ns], Python ints.

    One beyond what a message holds becomes the first or last that it does: the nanoseconds of a
    message that was received may be more than a second, and one that says so is made all the same.
    """
    return divmod(max(FIRST_STAMP, min(int(stamp), LAST_STAMP)), 10**9)


def matrix_of(message):
    """Return the (4, 4) transform of a message: child frame in header frame.

    Args:
        message: an object with the fields of geometry_msgs/TransformStamped, or with a pose:
            PoseStamped, PoseWithCovarianceStamped, Odometry. Its quaternion is normalised.

    Raises:
        InvalidTransform: a value is not finite, or the quaternion is no rotation.
    """
    if hasattr(message, 'transform'):
        t, q = message.transform.translation, message.transform.rotation
    else:
        pose = getattr(message.pose, 'pose', message.pose)
        t, q = pose.position, pose.orientation
    return matrix_from((t.x, t.y, t.z), (q.x, q.y, q.z, q.w))


def covariance_of(message):
    """Return the (6, 6) covariance, x y z rx ry rz, of a pose that has one; else None.

    Zeros, or -1 for the first variance, are what is not known.
    """
    if not hasattr(message, 'pose'):
        return None
    covariance = np.reshape(np.array(message.pose.covariance, dtype=np.float64), (6, 6))
    is_unknown = covariance[0, 0] == -1.0 or not covariance.any()
    return None if is_unknown else covariance


def matrix_from(translation, quaternion):
    """Return the (4, 4) transform of (x, y, z) and (qx, qy, qz, qw), see `matrix_of`."""
    translation = np.array(translation, dtype=np.float64)
    quaternion = np.array(quaternion, dtype=np.float64)
    if not (np.isfinite(translation).all() and np.isfinite(quaternion).all()):
        raise InvalidTransform(
            f'the transform is not finite: translation {translation}, quaternion {quaternion}'
        )
    if np.abs(translation).max() > LARGEST:
        raise InvalidTransform(f'the translation is {translation}, which nothing measures')
    norm = math.hypot(*quaternion)
    if not 1 / LARGEST_NORM < norm < LARGEST_NORM:
        raise InvalidTransform(
            f'the quaternion (x, y, z, w) is {quaternion}; it must have length 1 '
            '(0 0 0 1 for no rotation)'
        )
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(quaternion / norm).as_matrix()
    matrix[:3, 3] = translation
    return matrix


def translation_and_quaternion(matrix):
    """Return ((x, y, z), (qx, qy, qz, qw)) of a (4, 4) transform as Python floats."""
    quaternion = Rotation.from_matrix(matrix[:3, :3]).as_quat(canonical=True)
    return tuple(matrix[:3, 3].tolist()), tuple(quaternion.tolist())
