"""How a sensor turned, by the angular rates of an IMU on the same body."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.stamps import seconds
from idem_ros.pairing.guesses import EXTRAPOLATED, MOST
from idem_ros.pairing.stamped_poses import StampedPoses

IMU = 'sensor_msgs/msg/Imu'
LONGEST_GAP = 50_000_000  # [ns] between two messages
FASTEST = 100.0  # [rad/s]: gyroscopes measure up to 4000 degrees a second


class UnusableRates(IdemError):
    """Angular rates that do not tell how a sensor turned during a sweep; it says why."""


@dataclass(frozen=True)
class TurnRates:
    """The messages of an IMU around a stamp, and how its frame is turned in that of the sensor."""

    messages: StampedPoses
    frame: str
    R_source_imu: NDArray | None
    """(3, 3); None: nobody tells."""

    def turns_over(self, begin, end):
        """Return stamps [ns] (K,), and the rotations (K, 3, 3) since the first, of the source.

        The first is before an interval and the last after it, or not long after and before.

        Args:
            begin, end: [ns].

        Raises:
            UnusableRates: they do not reach over it, have a gap, or are of an unknown frame.
        """
        if self.R_source_imu is None:
            raise UnusableRates(
                f'nothing tells how its frame {self.frame!r} is turned in that of the source'
            )
        stamps = np.array(self.messages.stamps)
        first = max(int(np.searchsorted(stamps, begin, 'right')) - 1, 0)
        stamps = stamps[first : int(np.searchsorted(stamps, end)) + 1]
        _refuse_gaps(stamps, begin, end)
        rates = np.array([_rate_of(self.messages[each]) for each in stamps.tolist()])
        steps = np.diff(stamps)[:, None] / 1e9 * (rates[:-1] + rates[1:]) / 2.0
        turns = [Rotation.identity()]
        for step in Rotation.from_rotvec(steps @ self.R_source_imu.T):
            turns.append(turns[-1] * step)
        chosen = np.unique(np.linspace(0, len(stamps) - 1, MOST).round().astype(int))
        return stamps[chosen], Rotation.concatenate(turns).as_matrix()[chosen]


def _refuse_gaps(stamps, begin, end):
    if len(stamps) < 2:
        raise UnusableRates(f'during the sweep {len(stamps)} messages came; two are needed')
    gap = max(stamps[0] - begin, end - stamps[-1])
    if gap > EXTRAPOLATED:
        raise UnusableRates(f'it does not reach over the sweep: {seconds(gap)} are missing')
    if (gap := int(np.diff(stamps).max())) > LONGEST_GAP:
        raise UnusableRates(f'it has a gap of {seconds(gap)} during the sweep')


def _rate_of(message):
    rate = message.angular_velocity
    values = np.array([rate.x, rate.y, rate.z], dtype=np.float64)
    if message.angular_velocity_covariance[0] == -1.0:  # so sensor_msgs has it
        raise UnusableRates('it says itself that it measures no angular rates')
    if not np.isfinite(values).all():
        raise UnusableRates('an angular rate is not finite')
    if (fastest := np.abs(values).max()) > FASTEST:
        raise UnusableRates(f'it says {fastest:.3g} rad/s, which no gyroscope measures')
    return values
