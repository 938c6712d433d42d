"""The errors of odometry, whose frame begins where it does, against truth in another frame."""

from idem_ros.core.geometry.se3 import inverse
from idem_ros.files.trajectory_file import Trajectory
from idem_ros.trajectory.comparison_table import compared
from idem_ros.trajectory.errors import IncomparableTrajectories, associate


def tie_of(truths, estimate, frame):
    """Return T_odom_map, the (4, 4) frame of the truth in that of the poses; None without truth.

    The two are tied where the first pose with a truth is: there the error is none.

    Args:
        truths: `Truths` of the scans in any frame.
        estimate: `Trajectory` of the scans.
        frame: of the scans.
    """
    tie = None
    for pose, stamp in zip(estimate.poses, estimate.stamps.tolist(), strict=True):
        truth = truths.at(stamp, '', frame)  # of every one: why it is not believed is noted
        if tie is None and truth is not None:
            tie = pose @ inverse(truth)
    return tie


def errors_of(reference, estimate):
    """Return (the record of `trajectory_report.compared`, why there is none).

    The poses as a whole are moved so that the first that has a true one lies on it; rotation and
    scale of the rest are left as they are.

    Args:
        reference: `Trajectory` of the truth, or None.
        estimate: `Trajectory` of the scans.
    """
    if reference is None or len(estimate) < 2:
        return None, 'no truth is of the frame of the scans' if len(estimate) > 1 else ''
    try:
        truth, matched = associate(reference, estimate)
    except IncomparableTrajectories as error:
        return None, f'the trajectory is not compared with the truth: {error}'
    T_map_odom = truth.poses[0] @ inverse(matched.poses[0])
    moved = Trajectory(T_map_odom @ estimate.poses, estimate.stamps)
    return compared(reference, moved), ''
