"""What the sensors of a rig measured around one time, each point at a time of its own."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from idem_ros.calibration.rig_calibration import Instant, calibrate
from idem_ros.calibration.rig_motion import (
    Motion,
    at_one_time,
    is_still,
    motion_at_time,
    motion_covariances,
)
from idem_ros.core import IdemError
from idem_ros.core.metric.measured_points import usual
from idem_ros.core.trust.reasons import WIDER
from idem_ros.files.cloud_list import refuse_copy

WIDEST = 30 * WIDER  # times one cloud over another: no two sensors differ so, units do
STANDS = Motion(np.zeros(6), np.zeros((6, 6)))


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
        Uncalibrated: see `calibrate`; OtherUnits, RepeatedCloud: it says which sensor.
    """
    _refuse_copies(sightings, names)
    _require_one_unit(sightings, names)
    motions = [_motion(each, config) for each in sightings]

    def found_from(poses):
        """Return the `Calibration` of the clouds put to one time by the sensors' poses."""
        instants = [
            _instant(each, poses, motion) for each, motion in zip(sightings, motions, strict=True)
        ]
        return calibrate(instants, poses, config)

    found = found_from(starts)
    if any(motion is not None and not is_still(motion.twist) for motion in motions):
        found = found_from(np.array(found.poses))
    twists = {
        each.name: None if motion is None else motion.twist
        for each, motion in zip(sightings, motions, strict=True)
    }
    return replace(found, starts=starts), twists


def _motion(sighting, config):
    reference = sighting.measured[0]
    if not sighting.neighbours or reference is None:
        return None
    times = [each.times for each in sighting.measured if each and each.times is not None]
    times = np.concatenate(times) if times else np.zeros(1)
    neighbours = sighting.neighbours
    return motion_at_time(times.mean(), times.std(), reference, neighbours, config)


def _instant(sighting, poses, motion):
    if motion is None or is_still(motion.twist):
        motion = STANDS
    clouds = tuple(
        None if each is None else at_one_time(each, pose, motion.twist)
        for each, pose in zip(sighting.measured, poses, strict=True)
    )
    by_motion = motion_covariances(sighting.measured, poses, motion.covariance)
    return Instant(sighting.name, clouds, by_motion)


def _refuse_copies(sightings, names):
    for sighting in sightings:
        seen = {}
        for name, measured in zip(names, sighting.measured, strict=True):
            if measured is not None:
                refuse_copy(name, measured.points, seen)


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
