"""The motion of a sensor during its sweep, from pose to pose, and points without it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idem_ros.core import undistort
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.se3 import inverse, transform_points

ROS_ORDER = [3, 4, 5, 0, 1, 2]  # x y z rx ry rz of (omega, v), and back


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
        k = self._piece(time)
        return self.poses[k] @ motion_by(self._twist(k), time - self.times[k])

    def turned(self, times, rotations):
        """Return the track of these positions that turns as it was measured.

        Args:
            times: (K,), K >= 2, increasing [s].
            rotations: (K, 3, 3), since the first of them, in the frame's axes.
        """
        poses = np.array([self.pose_at(time) for time in times])
        poses[:, :3, :3] = poses[0, :3, :3] @ rotations
        return Track(np.asarray(times), poses)

    def step(self, begin, end):
        """Return the (4, 4) motion from one time [s] to another: the later pose in the earlier."""
        return inverse(self.pose_at(begin)) @ self.pose_at(end)

    def mean_twist(self, begin, end):
        """Return the constant twist (6,) that makes the step from one time [s] to another."""
        return twist_of(self.step(begin, end), end - begin)

    def undone(self, points, times, reference):
        """Return points (N, 3), measured at times (N,), in the frame at `reference` [s]."""
        pieces, undone = self._piece(times), np.empty_like(points)
        for k in np.unique(pieces):
            those = pieces == k
            moved = undistort(points[those], times[those], self._twist(k), float(self.times[k]))
            undone[those] = transform_points(self._to(reference, k), moved)
        return undone

    def _to(self, reference, k):
        return inverse(self.pose_at(reference)) @ self.poses[k]

    def _piece(self, times):
        return np.clip(np.searchsorted(self.times, times, 'right') - 1, 0, len(self.times) - 2)

    def _twist(self, k):
        return twist_of(inverse(self.poses[k]) @ self.poses[k + 1], np.diff(self.times)[k])


def twist_of(motion, duration):
    """Return the constant twist (6,), x y z rx ry rz a second, of a (4, 4) motion so long [s]."""
    return se3.log(motion)[ROS_ORDER] / duration


def motion_by(twist, duration):
    """Return the (4, 4) motion by a twist (6,), x y z rx ry rz per second, for so long [s]."""
    return se3.exp(np.asarray(twist, dtype=np.float64)[ROS_ORDER] * duration)
