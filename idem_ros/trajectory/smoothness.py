"""How smooth a trajectory is: what is there to judge by when nobody knows the truth."""

import numpy as np
from scipy.spatial.transform import Rotation


def second_differences(stamps, poses):
    """Return how far each pose is from where its neighbours in time would have it, twice.

    Where stamps are evenly spaced, that of the positions is |p(i+1) - 2 p(i) + p(i-1)|; where
    they are not, the neighbours are interpolated at the stamp, so that a missing frame is no
    jump.

    Args:
        stamps: (N,) [ns].
        poses: (N, 4, 4) of one body in one frame.

    Returns:
        (positions, rotations): (N,) in the unit of the poses and (N,) [deg]; NaN for the first
        and the last, which have one neighbour.
    """
    positions, rotations = np.full((2, len(poses)), np.nan)
    if len(poses) < 3:
        return positions, rotations
    share = _shares(np.asarray(stamps, dtype=np.int64))
    p = poses[:, :3, 3]
    between = p[:-2] + share[:, None] * (p[2:] - p[:-2])
    positions[1:-1] = 2 * np.linalg.norm(p[1:-1] - between, axis=1)
    R = poses[:, :3, :3]
    before, here, after = (Rotation.from_matrix(each) for each in (R[:-2], R[1:-1], R[2:]))
    turn = (before.inv() * after).as_rotvec()
    between = before * Rotation.from_rotvec(share[:, None] * turn)
    rotations[1:-1] = np.degrees(2 * (between.inv() * here).magnitude())
    return positions, rotations


def _shares(stamps):
    """Return when each inner stamp comes, from 0 at the one before to 1 at the one after."""
    before, here, after = stamps[:-2], stamps[1:-1], stamps[2:]
    ordered = (before < here) & (here < after)  # not where a recording was played in a loop
    span = np.where(ordered, after - before, 2)
    return np.where(ordered, here - before, 1) / span
