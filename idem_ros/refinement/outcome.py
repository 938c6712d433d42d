"""What becomes of a pair: a refined pose, and what it is made of."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from idem_ros.core import Cloud, RegistrationConfig, RegistrationResult
from idem_ros.refinement.track import motion_by


class StageTimes(NamedTuple):
    """What the stages of a refinement took [ms]; a target that was kept costs nothing."""

    reading: float = 0.0
    preparing: float = 0.0
    registering: float = 0.0
    judging: float = 0.0


class TookPart(NamedTuple):
    """What a refinement is made of."""

    target: Cloud
    source: Cloud
    config: RegistrationConfig


@dataclass(frozen=True)
class Refinement:
    """What became of one pair."""

    stamp: int
    """The source's [ns]."""
    target_frame: str
    source_frame: str
    T_guess: NDArray
    """(4, 4), source in target frame, as it was given; at the reference."""
    result: RegistrationResult
    q_tot_before: float | None
    """q_tot at the guess, at the radius of `result.q_tot` [nat]; None: not asked for."""
    time_ms: float
    """Reading the messages and registering; without `q_tot_before`."""
    points_target: int
    """Points that took part, of a map the voxels in reach; so `points_source`."""
    points_source: int
    dropped_nonfinite: int
    """Points left out of both clouds because they are not finite."""
    dropped_zero: int
    """Points left out of both clouds because they are exactly zero."""
    dropped_stray: int = 0
    """Points left out of both clouds because they are far from all the rest."""
    cropped: int = 0
    """Points left out of both clouds by the range limits and the crop box."""
    thinned: int = 0
    """Points left out of both clouds for `max_points`."""
    times: StageTimes = StageTimes()
    point_times: str = ''
    """How the times of points were read, or why there are none; empty where that is no news."""
    reference: float = 0.0
    """The instant that the poses are of, in seconds after the stamp."""
    lost: str = ''
    """Why the next guess leads nowhere, where it follows the last results; empty: it does."""
    took_part: TookPart | None = field(default=None, repr=False, compare=False)
    """None: the clouds were let go of."""

    @property
    def instant(self):
        """The time that the poses are of [ns]."""
        return self.stamp + round(1e9 * self.reference)

    def at_reference(self, T_stamp):
        """Return the (4, 4) pose at the reference of what has one at the stamp; so `at_stamp`."""
        return T_stamp @ self._motion(self.reference)

    def at_stamp(self, T_reference):
        """Return the (4, 4) pose at the stamp of what has one at the reference."""
        return T_reference @ self._motion(-self.reference)

    def _motion(self, duration):
        twist = self.result.twist
        return np.eye(4) if twist is None else motion_by(twist, duration)
