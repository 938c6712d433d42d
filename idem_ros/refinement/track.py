"""The motion of a sensor during its sweep, from pose to pose, and points without it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from idem_ros.core.geometry import se3
from idem_ros.core.geometry.se3 import inverse, inverses
from idem_ros.core.geometry.undistortion import moved_in_time

STEPS = 512  # of a sweep, between which a motion is linear: off by 1e-7 of a range at 90 deg/s


@dataclass(frozen=True)
class Track:
    """Where a frame was during a sweep: between its poses it moves by a constant twist."""

    times: NDArray
    """(K,), K >= 2, increasing, in seconds after the stamp."""
    poses: NDArray
    """(K, 4, 4), in a frame that stands still."""

    @classmethod
    def of_twist(cls, twist):
        """Return that of a constant twist (6,), x y z rx ry rz per second, in the frame's axes."""
        return cls(np.array([0.0, 1.0]), np.array([np.eye(4), motion_by(twist, 1.0)]))

    def pose_at(self, time):
        """Return the (4, 4) pose at a time [s]; before and after its own the motion goes on."""
        return self.poses_at(np.array([time]))[0]

    def poses_at(self, times):
        """Return the (K, 4, 4) poses at times (K,), see `pose_at`."""
        steps = inverses(self.poses[:-1]) @ self.poses[1:]
        twists = np.array([se3.log(step) for step in steps]) / np.diff(self.times)[:, None]
        k = np.clip(np.searchsorted(self.times, times, 'right') - 1, 0, len(steps) - 1)
        return self.poses[k] @ _exp((times - self.times[k])[:, None] * twists[k])

    def turned(self, times, rotations):
        """Return the track of these positions that turns as it was measured.

        Args:
            times: (K,), K >= 2, increasing [s].
            rotations: (K, 3, 3), since the first of them, in the frame's axes.
        """
        poses = self.poses_at(np.asarray(times))
        poses[:, :3, :3] = poses[0, :3, :3] @ rotations
        return Track(np.asarray(times), poses)

    def step(self, begin, end):
        """Return the (4, 4) motion from one time [s] to another: the later pose in the earlier."""
        return inverse(self.pose_at(begin)) @ self.pose_at(end)

    def mean_twist(self, begin, end):
        """Return the constant twist (6,) that makes the step from one time [s] to another."""
        return twist_of(self.step(begin, end), end - begin)

    def undone(self, points, times, reference, origin=(0.0, 0.0, 0.0)):
        """Return points (N, 3), measured at times (N,), in the frame at `reference` [s].

        origin: that points are given and returned from, in the frame at either time.
        """
        begin, end = float(times.min()), float(times.max())
        to_frame = se3.translation(np.asarray(origin))
        poses = self.poses_at(np.linspace(begin, end, STEPS)) @ to_frame
        steps = inverse(self.pose_at(reference) @ to_frame) @ poses
        return moved_in_time(points, times, steps, begin, end)


def twist_of(motion, duration):
    """Return the constant twist (6,), x y z rx ry rz a second, of a (4, 4) motion so long [s]."""
    return se3.log(motion)[se3.ROS_ORDER] / duration


def motion_by(twist, duration):
    """Return the (4, 4) motion by a twist (6,), x y z rx ry rz per second, for so long [s]."""
    return se3.exp(np.asarray(twist, dtype=np.float64)[se3.ROS_ORDER] * duration)


def _exp(twists):
    """Return the (K, 4, 4) motions of twists (omega, v), (K, 6), as `se3.exp` does of one."""
    omega, v = twists[:, :3], twists[:, 3:]
    square = np.einsum('ij,ij->i', omega, omega)[:, None]
    angle = np.sqrt(np.maximum(square, 1e-12))
    is_small = square < 1e-8  # Taylor: the quotients lose their digits
    b = np.where(is_small, 0.5 - square / 24.0, (1.0 - np.cos(angle)) / angle**2)
    c = np.where(is_small, 1.0 / 6.0 - square / 120.0, (angle - np.sin(angle)) / angle**3)
    once = np.cross(omega, v)
    motions = np.tile(np.eye(4), (len(twists), 1, 1))
    motions[:, :3, :3] = Rotation.from_rotvec(omega).as_matrix()
    motions[:, :3, 3] = v + b * once + c * np.cross(omega, once)
    return motions
