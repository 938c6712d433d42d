"""How each sensor of a rig moved from one time to a later one, by its own clouds alone.

In a recording these are its clouds around pairs of times, spread evenly over it.
"""

from contextlib import suppress
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from idem_ros.calibration.rig_motion import (
    Motion,
    at_one_time,
    is_still,
    motion_at_time,
    step_between,
)
from idem_ros.calibration.sighting_messages import SECOND, measured_in, nearest
from idem_ros.calibration.synchronized_scans import STANDS, Measured
from idem_ros.core import Cloud
from idem_ros.core.exceptions import IdemError
from idem_ros.core.geometry import se3
from idem_ros.core.several.joint_result import CloudVerdict
from idem_ros.messages.transform_message import stamp_ns

Clouds = tuple[tuple[Measured, float], ...]
"""Of a sensor around a time, the nearest first: each with how much later its stamp is [s]."""

EACH = 4  # strides, for an instant that is asked for
TURN = np.radians(30.0)  # a stride ends when the rig has turned by so much, or gone so far,
WAY = 15.0  # [m]: more tells more, as long as the clouds still meet
SHORTEST, LONGEST = 0.5, 3.0  # [s]


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
    result = step_between(
        first.cloud, second.cloud, config, se3.exp(seconds * twist[se3.ROS_ORDER])
    )
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


class Wanted(NamedTuple):
    """Which clouds a stride is of."""

    begin: list
    """Of each sensor [(topic, stamp)], the nearest first."""
    end: list
    times: tuple
    """[ns] of begin and end."""

    @property
    def keys(self):
        """Of all clouds."""
        return {key for keys in (*self.begin, *self.end) for key in keys}


def strides_in(recording, rig, count, twists, reading):
    """Yield `Stride`s that are spread evenly over a recording, each when its clouds were read.

    Args:
        recording: open `Recording`.
        rig: its `RecordedRig`.
        count: how many instants were asked for.
        twists: (6,) of the reference at some instants; None: unknown. Where all stand, there is
            no stride.
        reading: `PointTimeConfig`, and prepare(points, times), which returns those that take part.
    """
    waiting, found = _wanted(rig, count, twists), {}
    awaited = _keys(waiting)
    for topic, _, message in recording.messages(rig.topics if waiting else []):
        key = topic, stamp_ns(message)
        if key in found or key not in awaited:
            continue
        found[key] = None
        with suppress(IdemError):  # it tells of no step
            found[key] = measured_in(message, *reading)
        for each in [each for each in waiting if each.keys <= found.keys()]:
            waiting.remove(each)
            seen = (_seen(each, k, found) for k in (0, 1))
            first, last = (at / SECOND for at in each.times)
            yield Stride(*seen, last - first, first)
            awaited = _keys(waiting)
            found = {key: measured for key, measured in found.items() if key in awaited}


def _keys(waiting):
    return {key for each in waiting for key in each.keys}


def _wanted(rig, count, twists):
    """Return the `Wanted` of each stride."""
    length = _length(twists)
    reference = np.array(rig.stamps[rig.topics[0]])
    if length is None or len(reference) < 5:
        return []
    length = min(length, (reference[-2] - reference[1]) / SECOND / 2)
    period = float(np.median(np.diff(reference)))
    last = np.searchsorted(reference, reference[-2] - SECOND * length, 'right') - 1
    places = np.unique(np.linspace(1, max(last, 1), EACH * count).round().astype(int))
    found = []
    for place in places:
        after = np.searchsorted(reference, reference[place] + SECOND * length)
        times = tuple(int(reference[min(k, len(reference) - 2)]) for k in (place, after))
        found.append(Wanted(*([_around(rig, at, period) for at in times]), times))
    return found


def _length(twists):
    """Return how long strides are [s]; None: the rig stands."""
    known = [twist for twist in twists if twist is not None]
    moving = [twist for twist in known if not is_still(twist)]
    if not moving:
        return None if known else 1.0
    rate = max(np.linalg.norm(twist[3:]) for twist in moving)
    speed = max(np.linalg.norm(twist[:3]) for twist in moving)
    least = max(rate / TURN, speed / WAY)
    return float(np.clip(1.0 / least, SHORTEST, LONGEST))


def _around(rig, at, period):
    """Return of each sensor the cloud nearest to a time, the one after and the one before."""
    found = []
    for topic in rig.topics:
        stamps = rig.stamps[topic]
        near = nearest(stamps, at, period)
        place = None if near is None else stamps.index(near)
        some = [] if place is None else [place, place + 1, place - 1]
        found.append([(topic, stamps[k]) for k in some if 0 <= k < len(stamps)])
    return found


def _seen(wanted, k, found):
    """Return the `Clouds` of each sensor around begin or end; none without the nearest."""
    at, seen = wanted.times[k], []
    for keys in (wanted.begin, wanted.end)[k]:
        clouds = [(found[key], (key[1] - at) / SECOND) for key in keys]
        is_there = bool(clouds) and clouds[0][0] is not None
        seen.append(tuple(each for each in clouds if is_there and each[0] is not None))
    return tuple(seen)
