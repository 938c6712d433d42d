"""Messages with a pose, buffered by stamp, and the pose between two of them."""

import math
from bisect import bisect_left, bisect_right, insort

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.stamps import NotYet, seconds
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.pairing.guesses import WINDOW

KEPT = 2048  # ten seconds at 200 Hz


class DoubtfulGuess(IdemError):
    """Guesses of which none says where a source is: too old, too far apart, of other frames."""


class StampedPoses:
    """The messages of a stream of poses that were received last, in the order of their stamps.

    Of what is received, not of what is stamped last: a stamp may say anything.
    """

    def __init__(self):
        self._stamps = []
        self._messages = {}  # {stamp: message} in the order they came

    def __len__(self):
        return len(self._stamps)

    def __contains__(self, stamp):
        return stamp in self._messages

    def __getitem__(self, stamp):
        return self._messages[stamp]

    @property
    def stamps(self):
        """Those of the messages [ns], increasing."""
        return tuple(self._stamps)

    @property
    def newest(self):
        """The message with the latest stamp, of one at least."""
        return self._messages[self._stamps[-1]]

    def add(self, message):
        """Keep a message; one of the same stamp gives way to it."""
        stamp = stamp_ns(message)
        if self._messages.pop(stamp, None) is None:
            insort(self._stamps, stamp)
        self._messages[stamp] = message
        if len(self._stamps) > KEPT:
            oldest = next(iter(self._messages))
            del self._messages[oldest], self._stamps[bisect_left(self._stamps, oldest)]

    def forget_after(self, stamp):
        """Forget what is later than a stamp [ns]."""
        count = bisect_left(self._stamps, stamp + 1)
        for late in self._stamps[count:]:
            del self._messages[late]
        del self._stamps[count:]

    def near(self, stamp):
        """Return the poses not much before or after a stamp [ns], as they are now."""
        first, last = stamp - WINDOW, stamp + WINDOW
        near = StampedPoses()
        near._stamps = self._stamps[
            bisect_left(self._stamps, first) : bisect_right(self._stamps, last)
        ]
        near._messages = {each: self._messages[each] for each in near._stamps}
        return near

    def around(self, stamp):
        """Return the message of a stamp [ns], or the ones before and after it.

        Returns:
            List of one or two messages; a stamp before the first has that one only.

        Raises:
            NotYet: the stamp is after the newest.
        """
        if not self._stamps:
            raise NotYet('none has come')
        if stamp > self._stamps[-1]:
            age = seconds(stamp - self._stamps[-1])
            raise NotYet(f'the newest is {age} older than the source')
        return self.neighbours(stamp)

    def neighbours(self, stamp):
        """Return the message of a stamp [ns], or those that there are before and after it."""
        if stamp in self._messages:
            return [self._messages[stamp]]
        i = bisect_left(self._stamps, stamp)
        return [self._messages[kept] for kept in self._stamps[max(i - 1, 0) : i + 1]]


def pose_at(stamp, messages, config):
    """Return the (4, 4) pose at a stamp [ns] from the one or two messages around it.

    The pose of its own stamp is taken as it is; between two, the rotation is slerped and the
    translation is linear; before the first one that one holds.

    Raises:
        DoubtfulGuess: they are farther from the stamp, or from each other, than `GuessConfig`
            allows.
        InvalidTransform: one of them is none.
    """
    stamps = [stamp_ns(message) for message in messages]
    poses = [matrix_of(message) for message in messages]
    if stamps == [stamp]:
        return poses[0]
    off = max(abs(kept - stamp) for kept in stamps)
    if config.max_age is not None and off > config.max_age * 1e9:
        raise DoubtfulGuess(
            f'the nearest before or after the source is {seconds(off)} off; '
            f'initial_guess.max_age is {config.max_age:g} s'
        )
    if len(poses) == 1:
        return poses[0]
    jump = math.dist(poses[0][:3, 3], poses[1][:3, 3])
    if config.max_jump is not None and jump > config.max_jump:
        raise DoubtfulGuess(
            f'it jumps by {jump:.3g} m within the {seconds(stamps[1] - stamps[0])} around the '
            f'source; initial_guess.max_jump is {config.max_jump:g} m'
        )
    return interpolated(*poses, (stamp - stamps[0]) / (stamps[1] - stamps[0]))


def interpolated(first, second, fraction):
    """Return the (4, 4) pose a fraction of the way from one to another, each at constant speed."""
    rotations = Rotation.from_matrix([first[:3, :3], second[:3, :3]])
    pose = np.eye(4)
    pose[:3, :3] = Slerp([0.0, 1.0], rotations)(fraction).as_matrix()
    pose[:3, 3] = (1.0 - fraction) * first[:3, 3] + fraction * second[:3, 3]
    return pose
