"""Where the sensor was, by the trajectory that is to be made consistent."""

from pathlib import Path

import numpy as np

from idem_ros.core.exceptions import IdemError
from idem_ros.core.geometry.se3 import inverse
from idem_ros.files.trajectory_file import Trajectory, read_trajectory
from idem_ros.pairing.stamped_poses import interpolated
from idem_ros.refinement.sweep_motion import UnknownMotion
from idem_ros.refinement.track import Track, twist_of
from idem_ros.results.result_file import read_result

RESULTS = '.json', '.mcap'
WIDEST = 500_000_000  # [ns] between two poses that a scan may lie between
EXACT = 1_000_000  # [ns] by which stamps written with few digits are off


class UnusableTrajectory(IdemError):
    """A trajectory that is not of the recording."""


def read_odometry(path):
    """Return the `Trajectory` of a file, or of the result of `idem replay --sequence`.

    Raises:
        UnusableTrajectory: a result of pairs, or poses without stamps.
        UnreadableTrajectory, UnreadableResult: there is none in it.
    """
    is_result = Path(path).suffix.lower() in RESULTS
    trajectory = _of_result(read_result(path)) if is_result else read_trajectory(path)
    if trajectory.stamps is None:
        raise UnusableTrajectory(
            f'{path} has poses without stamps (KITTI lines have none), so that nothing says which '
            'scans they are of; give TUM lines t x y z qx qy qz qw'
        )
    return trajectory


def _of_result(result):
    sequence = result.record.get('sequence')
    if not isinstance(sequence, dict) or 'first_stamp' not in sequence:
        raise UnusableTrajectory(
            f'{result.path} is a result of pairs, not of a sequence; idem replay --sequence scan '
            'makes a trajectory'
        )
    rows = [(sequence['first_stamp'], np.eye(4))]
    rows += [
        (
            frame['stamp_ns'] + round(1e9 * (frame.get('reference') or 0.0)),
            frame['T_target_source'],
        )
        for frame in result.frames
    ]
    stamps, poses = zip(*rows, strict=True)
    return Trajectory(np.array(poses, dtype=np.float64), np.array(stamps, dtype=np.int64))


class Odometry:
    """Poses of a trajectory at the stamps of scans.

    Args:
        trajectory: `Trajectory` with stamps.
    """

    def __init__(self, trajectory):
        self._poses, self._stamps = trajectory.poses, trajectory.stamps

    @property
    def span(self):
        """First and last stamp [ns]."""
        return int(self._stamps[0]), int(self._stamps[-1])

    def at(self, stamp):
        """Return the (4, 4) pose at a stamp [ns], between two poses where it has none of its own.

        None where it does not say: before its first pose, after its last, or in a gap.
        """
        i = int(np.searchsorted(self._stamps, stamp))
        for k in (i, i - 1):
            if 0 <= k < len(self._stamps) and abs(int(self._stamps[k]) - stamp) <= EXACT:
                return self._poses[k]
        if not 0 < i < len(self._stamps):
            return None
        before, after = int(self._stamps[i - 1]), int(self._stamps[i])
        if after - before > WIDEST:
            return None
        fraction = (stamp - before) / (after - before)
        return interpolated(self._poses[i - 1], self._poses[i], fraction)

    def track(self, stamp):
        """Return the `Track` of a sweep that is stamped so [ns].

        Raises:
            UnknownMotion: there is no pose near enough before or after it.
        """
        i = int(np.clip(np.searchsorted(self._stamps, stamp + EXACT), 1, len(self._stamps) - 1))
        if len(self._stamps) < 2 or self._stamps[i] - self._stamps[i - 1] > WIDEST:
            raise UnknownMotion('the trajectory has no two poses around the sweep')
        step = inverse(self._poses[i - 1]) @ self._poses[i]
        return Track.of_twist(twist_of(step, int(self._stamps[i] - self._stamps[i - 1]) / 1e9))
