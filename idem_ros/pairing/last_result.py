"""Guesses that go on from the last result, from a pose that somebody gave or none."""

import itertools

from idem_ros.messages.stamps import NotYet
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.pairing.guesses import Guess, frames_of

STARTS = itertools.count(1)


class LastResult:
    """The last usable result for every source, and for the first one after a start its pose.

    A start is every PoseWithCovarianceStamped, as RViz's "2D Pose Estimate" sends it; of
    TransformStamped, which may be a stream, only the first; and a reset. The stamps of poses say
    nothing. Results from before a start are forgotten; its pose is of use again after a clock was
    set back.

    Args:
        needs_pose: whether sources wait for a pose; else they begin with the identity.
    """

    def __init__(self, needs_pose=False):
        self._needs_pose = needs_pose
        self._first = None
        self._start = 0

    def __bool__(self):
        return not self._needs_pose or self._first is not None

    def stamps(self, message):
        """Return no (stream, stamp): a pose from long ago sets no clock back."""
        return []

    def add(self, message):
        """Keep a pose.

        Raises:
            InvalidTransform: it is none; the one before is kept.
        """
        matrix_of(message)
        if self._first is None or not _is_transform(message):
            self._start = next(STARTS)
        self._first = message

    def reset(self):
        """Forget the last result; where sources wait for a pose, they wait for another."""
        self._start = next(STARTS)
        if self._needs_pose:
            self._first = None

    def forget_after(self, stamp):
        """Forget a TransformStamped where it is later than a stamp [ns]."""
        if self._first is None or not _is_transform(self._first):
            return
        if stamp_ns(self._first) > stamp:
            self._first = None

    def guess_for(self, stamp, target_frame, source_frame, config):
        """Return the `Guess`.

        Raises:
            NotYet: a pose is needed, and none has come.
        """
        if self._first is not None:
            T_first = matrix_of(self._first)
            frames = frames_of(self._first)
            known = {'start': self._start, 'lost_after': config.lost_after}
            return Guess(None, *frames, T_first=T_first, **known)
        if self._needs_pose:
            raise NotYet('no pose has come to start from')
        return Guess(None, start=self._start, lost_after=config.lost_after)


def _is_transform(message):
    return hasattr(message, 'transform')
