"""A source that was measured while its sensor moved, and what undoing that motion makes of it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Floats, Twist
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.undistortion import (
    checked_twist,
    flaw_of_times,
    reference_time,
    undo,
)
from idem_ros.core.metric.cloud import Cloud

ROS_ORDER = [3, 4, 5, 0, 1, 2]  # of (omega, v), and back
SAMPLE = 2000  # points, about, that tell how far they moved


class Sweep(NamedTuple):
    """A cloud, and the motion of its sensor while it was measured."""

    measured: Cloud  # as it was given
    twist: Twist | None = None  # (omega, v) a second, at the cloud's origin; None: it stood still
    reference: float = 0.0  # [s] from the stamp: the instant that points are moved to
    flaw: str = ''  # why a motion that was asked for is not undone

    def undone(self) -> Cloud:
        """Return the cloud as a sensor would have seen it that stood still at the reference."""
        if self.twist is None or self.measured.times is None:
            return self.measured
        points = np.empty_like(self.measured.points)
        of_frame = self.twist[ROS_ORDER]
        undo(self.measured.points, self.measured.times, of_frame, self.reference, points)
        return self.measured.moved_to(points)

    def twist_of_frame(self) -> Floats | None:
        """Return the twist (6,), x y z rx ry rz a second, of the source frame."""
        if self.twist is None:
            return None
        return (se3.adjoint(se3.translation(self.measured.origin)) @ self.twist)[ROS_ORDER]

    def moved(self) -> float:
        """Return how far the motion moves points, the median, in the cloud's unit."""
        if self.twist is None or self.measured.times is None:
            return 0.0
        every = max(len(self.measured) // SAMPLE, 1)
        points = np.ascontiguousarray(self.measured.points[::every])
        times, undone = self.measured.times[::every].copy(), np.empty_like(points)
        undo(points, times, self.twist[ROS_ORDER], self.reference, undone)
        return float(np.median(np.linalg.norm(undone - points, axis=1)))


def sweep_of(source: Cloud, twist: ArrayLike | None, config: RegistrationConfig) -> Sweep:
    """Return the `Sweep` of a source by what is known of its motion.

    Args:
        source: `Cloud`, with its times where its sensor moved.
        twist: (6,) x y z rx ry rz a second, of the source frame in its own axes; None: unknown.
        config: which motion is undone, and to which instant.

    Raises:
        InvalidTransform: the twist is not six finite numbers.
        InvalidConfig: a twist is given, and no motion is to be undone.
    """
    if twist is not None:
        twist = checked_twist(twist)
    if config.motion == 'none':
        if twist is not None:
            raise InvalidConfig('a twist is given and motion is none; it must be guess or last')
        return Sweep(source)
    if source.times is None:
        return Sweep(source, flaw='the source has no point times')
    flaw = flaw_of_times(source.times)
    if flaw or twist is None:
        return Sweep(source, flaw=flaw or 'no twist of the sweep is known')
    to_origin = se3.adjoint(se3.translation(-source.origin))
    reference = reference_time(source.times, config.motion_reference)
    return Sweep(source, to_origin @ twist[ROS_ORDER], reference)
