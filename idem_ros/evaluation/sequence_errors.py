"""The errors of odometry, whose frame begins where it does, against truth in another frame."""

import numpy as np

from idem_ros.core.se3 import inverse
from idem_ros.evaluation.trajectory import IncomparableTrajectories, associate
from idem_ros.evaluation.trajectory_report import compared
from idem_ros.trajectory_files import Trajectory


def truth_in(truths, poses, frame):
    """Return {stamp: (4, 4) truth in the frame of the poses}, as far as there is truth.

    The two frames are tied where the first pose with a truth is: there the error is none.

    Args:
        truths: `Truths` of the scans in any frame.
        poses: {stamp [ns]: (4, 4) pose of a scan}, in the order of time.
        frame: of the scans.
    """
    known = {stamp: truths.at(stamp, '', frame) for stamp in poses}
    known = {stamp: truth for stamp, truth in known.items() if truth is not None}
    if not known:
        return {}
    first = next(iter(known))
    T_odom_map = poses[first] @ inverse(known[first])
    return {stamp: T_odom_map @ truth for stamp, truth in known.items()}


def errors_of(reference, poses):
    """Return (the record of `trajectory_report.compared`, why there is none).

    The poses as a whole are moved so that the first that has a true one lies on it; rotation and
    scale of the rest are left as they are.

    Args:
        reference: `Trajectory` of the truth, or None.
        poses: as `truth_in` takes them.
    """
    if reference is None or len(poses) < 2:
        return None, 'no truth is of the frame of the scans' if len(poses) > 1 else ''
    stamps = np.array(list(poses), dtype=np.int64)
    estimate = Trajectory(np.array(list(poses.values())), stamps)
    try:
        truth, matched = associate(reference, estimate)
    except IncomparableTrajectories as error:
        return None, f'the trajectory is not compared with the truth: {error}'
    T_map_odom = truth.poses[0] @ inverse(matched.poses[0])
    moved = Trajectory(T_map_odom @ estimate.poses, stamps)
    return compared(reference, moved), ''
