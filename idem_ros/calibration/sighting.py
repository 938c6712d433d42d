"""What the sensors of a rig measured around one time, each point at a time of its own."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from idem_ros.calibration.calibrating import calibrate
from idem_ros.calibration.instant import Instant
from idem_ros.calibration.rig_motion import at_one_time, is_still, twist_at_time
from idem_ros.core import IdemError
from idem_ros.core.metric.measured_points import usual
from idem_ros.core.trust.assessment import WIDER

WIDEST = 30 * WIDER  # times one cloud over another: no two sensors differ so, units do


class OtherUnits(IdemError):
    """Clouds of which one is as if it were in another unit."""


class Measured(NamedTuple):
    """The points of one sensor."""

    points: NDArray[np.float64]
    """(N, 3), in its frame."""
    times: NDArray[np.float64] | None = None
    """(N,) [s] after the time of the sighting; None: unknown."""

    def later(self, seconds):
        """Return the same, seen from so much earlier [s]."""
        return Measured(self.points, self.times + seconds)


class Sighting(NamedTuple):
    """What the sensors measured around one time."""

    name: str
    measured: tuple[Measured | None, ...]
    """Of each, the reference's first; None: it was silent."""
    neighbours: tuple[tuple[Measured, float], ...] = ()
    """Up to two more clouds of the reference, and how much later each is [s]."""


def calibrate_sightings(sightings, names, starts, config):
    """Return the `Calibration`, and {sighting: twist (6,) of the reference, or None}.

    Where the rig moved, its clouds are put to one time by the motion of the reference, for which
    the sensors' places must be known: so it is calibrated twice.

    Raises:
        Uncalibrated: see `calibrate`; OtherUnits: it says which sensor.
    """
    _require_one_unit(sightings, names)
    twists = [_twist(each, config) for each in sightings]

    def found_from(poses):
        """Return the `Calibration` of the clouds put to one time by the sensors' poses."""
        instants = [
            _instant(each, poses, twist) for each, twist in zip(sightings, twists, strict=True)
        ]
        return calibrate(instants, poses, config)

    found = found_from(starts)
    if any(twist is not None and not is_still(twist) for twist in twists):
        found = found_from(np.array(found.poses))
    named = {each.name: twist for each, twist in zip(sightings, twists, strict=True)}
    return replace(found, starts=starts), named


def _twist(sighting, config):
    reference = sighting.measured[0]
    if not sighting.neighbours or reference is None:
        return None
    times = [each.times.mean() for each in sighting.measured if each and each.times is not None]
    when = float(np.mean(times)) if times else 0.0
    return twist_at_time(when, reference, sighting.neighbours, config)


def _instant(sighting, poses, twist):
    if twist is None or is_still(twist):
        twist = np.zeros(6)
    clouds = (
        None if each is None else at_one_time(each, pose, twist)
        for each, pose in zip(sighting.measured, poses, strict=True)
    )
    return Instant(sighting.name, tuple(clouds))


def _width(points):
    near = usual(points - np.median(points, axis=0))
    return float(np.ptp(near, axis=0).max())


def _require_one_unit(sightings, names):
    widths = [
        [_width(each.points) for each in of_sensor if each is not None]
        for of_sensor in zip(*(each.measured for each in sightings), strict=True)
    ]
    medians = np.array([np.median(each) if each else np.nan for each in widths])
    if np.isnan(medians).all():
        return
    low, high = np.nanmin(medians), np.nanmax(medians)
    if low > 0.0 and high > WIDEST * low:
        raise OtherUnits(
            f'the clouds of {names[np.nanargmax(medians)]} are {high:.3g} wide, those of '
            f'{names[np.nanargmin(medians)]} {low:.3g}: the same unit? scale one of them'
        )
