"""Messages of poses, as plain records: what the pairing and its buffers read of them."""

from types import SimpleNamespace as Record

import numpy as np

from idem_ros.messages.transform_message import translation_and_quaternion

SECOND = 10**9


def header(stamp, frame=''):
    sec, nanosec = divmod(int(stamp), SECOND)
    return Record(stamp=Record(sec=sec, nanosec=nanosec), frame_id=frame)


def transform(stamp, pose=None, frame='', child=''):
    """A geometry_msgs/TransformStamped; `pose` is a matrix, x alone, or None for the identity."""
    t, q = _parts(pose)
    return Record(
        header=header(stamp, frame),
        child_frame_id=child,
        transform=Record(translation=Record(**t), rotation=Record(**q)),
    )


def pose_with_covariance(stamp, pose=None, frame=''):
    """A geometry_msgs/PoseWithCovarianceStamped."""
    t, q = _parts(pose)
    inner = Record(position=Record(**t), orientation=Record(**q))
    return Record(header=header(stamp, frame), pose=Record(pose=inner, covariance=[0.0] * 36))


def odometry(stamp, pose=None, frame='', child=''):
    """A nav_msgs/Odometry."""
    return Record(**vars(pose_with_covariance(stamp, pose, frame)), child_frame_id=child)


def tf(*transforms):
    """A tf2_msgs/TFMessage."""
    return Record(transforms=list(transforms))


def shifted(x):
    """The pose that is x off along the first axis."""
    pose = np.eye(4)
    pose[0, 3] = x
    return pose


def _parts(pose):
    pose = np.eye(4) if pose is None else shifted(pose) if np.isscalar(pose) else pose
    translation, quaternion = translation_and_quaternion(pose)
    return dict(zip('xyz', translation, strict=True)), dict(zip('xyzw', quaternion, strict=True))


def imu(stamp, rate, frame='', measures=True):
    """A sensor_msgs/Imu of angular rates (3,) [rad/s]."""
    covariance = [0.0 if measures else -1.0] + [0.0] * 8
    angular = Record(**dict(zip('xyz', map(float, rate), strict=True)))
    return Record(
        header=header(stamp, frame),
        angular_velocity=angular,
        angular_velocity_covariance=covariance,
    )
