"""The errors of KITTI's odometry benchmark: drift over segments of 100 to 800 m."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from idem_ros.trajectory.errors import path_length, relative

LENGTHS = (100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0)  # [m]
STEP = 10  # frames from the beginning of a segment to that of the next


@dataclass(frozen=True)
class Segments:
    """Errors of N segments of a path."""

    length_m: NDArray
    """(N,)"""
    translation_percent: NDArray
    """(N,), of the length."""
    rotation_deg_per_100m: NDArray
    """(N,)"""

    def __len__(self):
        return len(self.length_m)


def segment_errors(reference, estimate, lengths=LENGTHS):
    """Return the errors over segments of the reference's path, as KITTI's devkit has them.

    Segments begin at every tenth frame and end at the first one that is farther along the
    reference's path than their length.

    Args:
        reference, estimate: `Trajectory` of the same length.
        lengths: of the segments [m].

    Returns:
        `Segments`; none where the path is too short.
    """
    path = path_length(reference)
    first, length = (a.ravel() for a in np.meshgrid(np.arange(0, len(path), STEP), lengths))
    last = np.searchsorted(path, path[first] + length, side='right')
    ends = last < len(path)
    first, last, length = first[ends], last[ends], length[ends]
    if not len(first):  # scipy refuses an empty stack of rotations
        return Segments(*np.empty((3, 0)))
    error = relative(
        relative(estimate.poses[first], estimate.poses[last]),
        relative(reference.poses[first], reference.poses[last]),
    )
    angle = np.degrees(Rotation.from_matrix(error[:, :3, :3]).magnitude())
    distance = np.linalg.norm(error[:, :3, 3], axis=1)
    return Segments(length, 100 * distance / length, 100 * angle / length)
