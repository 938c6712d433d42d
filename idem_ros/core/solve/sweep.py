"""A source that was measured while its sensor moved, and what undoing that motion makes of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Floats, Points, Transform, Transforms, Twist
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

SAMPLE = 2000  # points, about, that tell how far they moved


class Sweep(NamedTuple):
    """A cloud, and the motion of its sensor while it was measured: at t, T exp(t twist)."""

    measured: Cloud  # each point in the sensor's frame at its own time
    twist: Twist | None = None  # (omega, v) a second, at the cloud's origin; None: it stood still
    reference: float = 0.0  # [s] from the stamp: the instant that points are moved to
    begin: float = 0.0  # [s] from the stamp: of the first point
    end: float = 0.0
    is_solved: bool = False  # whether the twist is where the solver starts
    given: Floats | None = None  # (6,) x y z rx ry rz a second: what was known of it
    flaw: str = ''  # why a motion that was asked for is not undone

    def undone(self) -> Cloud:
        """Return the cloud as a sensor would have seen it that stood still at the reference."""
        if self.twist is None or self.measured.times is None or not self.twist.any():
            return self.measured
        points, times = np.array(self.measured.points), np.array(self.measured.times)
        return self.measured.moved_to(self.moved(points, times, self.twist))

    def of_undone(self, cloud: Cloud) -> Sweep:
        """Return the sweep of what was made of the cloud undone, such as its voxels."""
        if self.twist is None or cloud.times is None or not self.twist.any():
            return self._replace(measured=cloud)
        points, times = np.array(cloud.points), np.array(cloud.times)
        return self._replace(measured=cloud.moved_to(self.moved(points, times, -self.twist)))

    def moved(self, points: Points, times: Floats, twist: Twist) -> Points:
        """Return points (N, 3), measured at times (N,), undone by a twist (omega, v) a second."""
        undone = np.empty_like(points)
        undo(points, times, twist[se3.ROS_ORDER], self.reference, undone)
        return undone

    def poses(self, T_reference: Transform) -> Transforms:
        """Return the poses (2, 4, 4) at begin and end, given that at the reference."""
        at = self.begin - self.reference, self.end - self.reference
        return np.array([T_reference @ se3.exp(t * self._known()) for t in at])

    def read(self, poses: Transforms) -> tuple[Transform, Twist]:
        """Return the pose at the reference and the twist, given the poses at begin and end."""
        motion = se3.log(se3.inverse(poses[0]) @ poses[1])
        fraction, takes = self.fraction, self.end - self.begin
        return poses[0] @ se3.exp(fraction * motion), motion / takes

    @property
    def fraction(self) -> float:
        """The reference's place in the sweep: 0 at its begin, 1 at its end."""
        return (self.reference - self.begin) / (self.end - self.begin)

    @property
    def is_unknown(self) -> bool:
        """Whether its motion is solved, and nothing was known of it."""
        return self.is_solved and self.given is None

    def twist_of_frame(self) -> Floats | None:
        """Return the twist (6,), x y z rx ry rz a second, of the source frame."""
        if self.twist is None:
            return None
        return (se3.adjoint(se3.translation(self.measured.origin)) @ self.twist)[se3.ROS_ORDER]

    def distance(self) -> float:
        """Return how far the motion moves points, the median, in the cloud's unit."""
        if self.twist is None or self.measured.times is None:
            return 0.0
        every = max(len(self.measured) // SAMPLE, 1)
        points, times = self.measured.points[::every], self.measured.times[::every]
        points, times = points.copy(), times.copy()
        moves = self.moved(points, times, self.twist) - points
        return float(np.median(np.linalg.norm(moves, axis=1)))

    def _known(self) -> Twist:
        assert self.twist is not None, 'it moves'
        return self.twist


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
    known = None if twist is None else checked_twist(twist)
    if config.motion == 'none':
        if known is not None:
            raise InvalidConfig('a twist is given and motion is none: it would not be undone')
        return Sweep(source)
    if source.times is None:
        return Sweep(source, flaw='the source has no point times')
    if flaw := flaw_of_times(source.times):
        return Sweep(source, flaw=flaw)
    is_solved = config.motion == 'solve' and config.mode == 'refine'
    if known is None:
        if not is_solved:
            return Sweep(source, flaw='no twist of the sweep is known')
        known = np.zeros(6)
    to_origin = se3.adjoint(se3.translation(-source.origin))
    reference = reference_time(source.times, config.motion_reference)
    begin, end = float(source.times.min()), float(source.times.max())
    given = None if twist is None else known
    return Sweep(source, to_origin @ known[se3.ROS_ORDER], reference, begin, end, is_solved, given)
