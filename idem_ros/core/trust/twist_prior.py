"""A twist that is known beforehand is weighed against what the clouds say of a sweep's motion.

Of constant velocity, by the sweep before; or of an odometry. As for a guess (`prior`), the result
is that of maximum a posteriori, both errors taken to be normal; what it tells of the twist tells
of the pose, too, by how the two errors go together.
"""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Transform
from idem_ros.core.geometry import se3
from idem_ros.core.trust.pose_twist import to_pose
from idem_ros.core.trust.prior import FARTHEST_SQUARED


class WeighedTwist(NamedTuple):
    """A result that a twist has been weighed into."""

    transform: Transform
    twist: Floats  # (6,) x y z rx ry rz a second
    covariance: Floats  # (12, 12) of the pose and of the twist
    distance: float  # from what was found to what was known, in the deviations of both
    is_believed: bool  # whether what was known may be as near as it says; else it is not weighed


def weighed_twist(
    T: Transform,
    twist: Floats,
    covariance: Floats,
    given: Floats,
    sigma: tuple[float, ...],
    position: Floats,
) -> WeighedTwist:
    """Return a result weighed against the twist that was given.

    Args:
        T: (4, 4) its pose, between the clouds' origins.
        twist: (6,) that was found, x y z rx ry rz a second.
        covariance: (12, 12) of the pose, x y z rx ry rz, and of the twist.
        given: (6,) the twist that was known.
        sigma: its standard deviations, a length and an angle [deg] a second; 0: nothing is known.
        position: (3,) of the source frame's origin in the target frame, at the pose.
    """
    length, degrees = sigma
    deviations = np.repeat([length, np.radians(degrees)], 3)
    some = 6 + np.flatnonzero(deviations)
    off = (given - twist)[some - 6]
    of_both = covariance[np.ix_(some, some)] + np.diag(deviations[some - 6] ** 2)
    gain: Floats = np.asarray(np.linalg.solve(of_both, covariance[some]), np.float64).T
    squared = float(off @ np.linalg.solve(of_both, off))
    if squared > FARTHEST_SQUARED:
        return WeighedTwist(T, twist, covariance, float(np.sqrt(squared)), is_believed=False)
    shift: Floats = gain @ off
    of_pose = np.asarray(np.linalg.solve(to_pose(position), shift[:6]), np.float64)
    rest = covariance - gain @ covariance[some]
    T = se3.exp(of_pose) @ T
    return WeighedTwist(T, twist + shift[6:], rest, float(np.sqrt(squared)), is_believed=True)
