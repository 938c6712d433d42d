"""The ground truth of a recording by stamp: poses, not messages, which would fill the memory."""

import numpy as np

from idem_ros.core import IdemError
from idem_ros.pairing import frame_contradiction
from idem_ros.trajectory_files import Trajectory
from idem_ros.transform_message import matrix_of, stamp_ns


class Truths:
    """The truth of each stamp, which may come before its source or after.

    Attributes:
        notes: why some are not believed, each reason once.
    """

    def __init__(self):
        self.notes = []
        self._poses = {}

    def __contains__(self, stamp):
        return stamp in self._poses

    def add(self, message):
        """Keep a TransformStamped, source in target frame; return its stamp [ns]."""
        try:
            pose = matrix_of(message)
        except IdemError as error:
            pose = f'truth: {error}'
        stamp = stamp_ns(message)
        self._poses[stamp] = message.header.frame_id, message.child_frame_id, pose
        return stamp

    def at(self, stamp, target_frame, source_frame):
        """Return the (4, 4) truth of a stamp [ns]; None where there is none to be believed.

        Args:
            stamp: of the source.
            target_frame, source_frame: of the clouds; an empty one contradicts nothing.
        """
        if stamp not in self._poses:
            return None
        *frames, pose = self._poses[stamp]
        reason = frame_contradiction('truth', tuple(frames), (target_frame, source_frame))
        if not reason and not isinstance(pose, str):
            return pose
        if (reason or pose) not in self.notes:
            self.notes.append(reason or pose)
        return None

    def trajectory(self, source_frame):
        """Return the `Trajectory` of a frame, in the order of time; None where there is none."""
        poses = {stamp: self.at(stamp, '', source_frame) for stamp in sorted(self._poses)}
        known = {stamp: pose for stamp, pose in poses.items() if pose is not None}
        if not known:
            return None
        return Trajectory(np.array(list(known.values())), np.array(list(known), dtype=np.int64))
