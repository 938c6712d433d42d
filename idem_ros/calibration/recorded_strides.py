"""Strides of a rig in a recording: what its sensors saw around pairs of times."""

from contextlib import suppress
from typing import NamedTuple

import numpy as np

from idem_ros.calibration.relative_motions import Stride
from idem_ros.calibration.rig_motion import is_still
from idem_ros.calibration.sighting_messages import SECOND, measured_in, nearest
from idem_ros.core.exceptions import IdemError
from idem_ros.messages.transform_message import stamp_ns

EACH = 4  # strides, for an instant that is asked for
TURN = np.radians(30.0)  # a stride ends when the rig has turned by so much, or gone so far,
WAY = 15.0  # [m]: more tells more, as long as the clouds still meet
SHORTEST, LONGEST = 0.5, 3.0  # [s]


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
