"""How each sensor of a rig moved from one time to a later one, by its own clouds alone."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from idem_ros.calibration.rig_motion import (
    ORDER,
    Motion,
    at_one_time,
    motion_at_time,
    step_between,
)
from idem_ros.calibration.synchronized_scans import STANDS, Measured
from idem_ros.core import Cloud
from idem_ros.core.geometry import se3
from idem_ros.core.several.joint_result import CloudVerdict

Clouds = tuple[tuple[Measured, float], ...]
"""Of a sensor around a time, the nearest first: each with how much later its stamp is [s]."""


class Stride(NamedTuple):
    """What the sensors of a rig saw around two times."""

    begin: tuple[Clouds, ...]
    """Of each sensor, the reference's first; empty: it was silent."""
    end: tuple[Clouds, ...]
    seconds: float
    """From the one time to the other."""
    at: float = 0.0
    """When it begins [s]."""


class Step(NamedTuple):
    """How one sensor moved."""

    T: NDArray[np.float64]
    """(4, 4) where it was later, in its own frame of earlier."""
    covariance: NDArray[np.float64]
    """(6, 6) x y z rx ry rz of it, in the axes of that frame."""
    verdict: CloudVerdict


class Stilled(NamedTuple):
    """What a sensor would have seen, had it stood at a time."""

    cloud: Cloud
    motion: Motion
    covariance: NDArray[np.float64]
    """(6, 6) of its pose at that time, in its own axes, by what is not known of the motion."""


def steps_of(stride, config):
    """Return the `Step` of each sensor, the reference's first; None: its clouds do not tell.

    All are between the same two times, each in the middle of what the sensors measured around it:
    there an error of their motion, by which clouds are put to it, moves them least.

    Args:
        stride: `Stride`.
        config: `RegistrationConfig`, of the voxels that all are calibrated by.
    """
    times = [_middle(each) for each in (stride.begin, stride.end)]
    seconds = stride.seconds + times[1] - times[0]
    return tuple(
        _step(clouds, times, seconds, config) if all(clouds) else None
        for clouds in zip(stride.begin, stride.end, strict=True)
    )


def strides_between(sightings):
    """Return a `Stride` from each `Sighting` to the next, of sensors that stood at both."""

    def seen(sighting):
        """Return the `Clouds` of each sensor."""
        return tuple(((each, 0.0),) if each else () for each in sighting.measured)

    return [Stride(seen(first), seen(second), 0.0) for first, second in pairwise(sightings)]


def _middle(of_sensors):
    """Return when points of all sensors were measured, in the mean, after a time [s]."""
    found = [
        late + (0.0 if measured.times is None else float(np.mean(measured.times)))
        for clouds in of_sensors
        for measured, late in clouds[:1]
    ]
    return float(np.mean(found)) if found else 0.0


def _step(clouds, times, seconds, config):
    first, second = (
        _stilled(each, time, config) for each, time in zip(clouds, times, strict=True)
    )
    if first is None or second is None:
        return None
    twist = (first.motion.twist + second.motion.twist) / 2
    result = step_between(first.cloud, second.cloud, config, se3.exp(seconds * twist[ORDER]))
    if result is None:
        return None
    T, said = result.T_target_source, result.assessment
    assert said is not None, 'verdicts are asked for'
    of_first, of_second = np.eye(6), np.kron(np.eye(2), T[:3, :3])
    of_first[:3, 3:] = -se3.skew(T[:3, 3])
    covariance = (
        said.covariance
        + of_first @ first.covariance @ of_first.T
        + of_second @ second.covariance @ of_second.T
    )
    return Step(T, covariance, CloudVerdict(said.verdict, said.p_aligned, said.reason))


def _stilled(clouds, time, config):
    """Return the `Stilled` of a sensor; None: its motion is unknown."""
    (measured, late), *others = clouds
    motion, later = STANDS, 0.0
    if others and measured.times is not None:
        neighbours = [(each, other - late) for each, other in others]
        middle, spread = float(measured.times.mean()), float(measured.times.std())
        motion = motion_at_time(middle, spread, measured, neighbours, config)
        if motion is None:
            return None
        measured, later = measured.later(late - time), late - time + middle
    cloud = at_one_time(measured, np.eye(4), motion.twist)
    return Stilled(cloud, motion, later**2 * motion.covariance)
