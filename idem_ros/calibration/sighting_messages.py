"""Sightings of a rig from messages: which clouds belong together, and what is in them."""

from collections import deque
from typing import NamedTuple

import numpy as np

from idem_ros.calibration.frame_tree import bare
from idem_ros.calibration.synchronized_scans import Measured, Sighting
from idem_ros.core.exceptions import IdemError
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.stamps import seconds
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.refinement.preprocessing import preprocess

SECOND = 1e9  # [ns]
APART = 2_000_000_000  # [ns] of the newest clouds of two sensors: no two are so unlike
SILENT = 'is silent'
KEPT = 4  # clouds of a sensor: one before the instant, itself, one after, one that the others need


class Row(NamedTuple):
    """The messages of one instant."""

    names: tuple
    """The frames of the sensors, the reference's first."""
    messages: tuple
    """Of each; None: it was silent."""
    around: tuple
    """Of the reference before and after."""


class LiveRig:
    """Gathers the messages of a rig's sensors, as they come, to instants.

    An instant is the last but two of the reference: by then the others have had their time.

    Args:
        count: how many sensors there are, the reference first.
    """

    def __init__(self, count):
        self._heard = [deque(maxlen=KEPT) for _ in range(count)]
        self._set_back = [0] * count  # clouds in a row that were not after the one before

    def add(self, sensor, message):
        """Take a message of a sensor; one that is older than its last makes it begin anew."""
        heard = self._heard[sensor]
        is_after = not heard or stamp_ns(message) > stamp_ns(heard[-1])
        self._set_back[sensor] = 0 if is_after else self._set_back[sensor] + 1
        if not is_after:
            heard.clear()  # a clock was set back, or a recording begins again
        heard.append(message)

    def flaws(self):
        """Return {number: what keeps a sensor out of instants}, of those that something does."""
        reference = [stamp_ns(each) for each in self._heard[0]]
        found = {}
        for s, heard in enumerate(self._heard):
            behind = reference[-1] - stamp_ns(heard[-1]) if heard and reference else 0
            if not heard:
                found[s] = SILENT
            elif self._set_back[s] > 1:
                found[s] = 'has clouds whose stamps do not increase'
            elif abs(behind) > APART:
                way = 'behind' if behind > 0 else 'ahead of'
                why = 'it has stopped, or its stamps are of another clock'
                found[s] = f'is {seconds(abs(behind))} {way} the reference: {why}'
        return found

    def row(self):
        """Return the `Row` of the newest instant; None: it is not complete.

        A sensor of which nothing has come is not of it: nobody knows its frame.
        """
        reference, *_ = self._heard
        if len(reference) < KEPT:
            return None
        stamps = [stamp_ns(each) for each in reference]
        at, period = stamps[1], float(np.median(np.diff(stamps)))
        known = [heard for heard in self._heard if heard]
        messages = [reference[1]]
        for heard in known[1:]:
            by_stamp = {stamp_ns(each): each for each in heard}
            messages.append(by_stamp.get(nearest(by_stamp, at, period)))
        names = tuple(bare(heard[-1].header.frame_id) for heard in known)
        return Row(names, tuple(messages), (reference[2], reference[0]))


def sighting_of(row, point_times, prepare):
    """Return the `Sighting` of a `Row`, and a line about each cloud that cannot be used.

    Raises:
        IdemError: two sensors have one frame.
    """
    if doubled := [name for name in row.names if row.names.count(name) > 1]:
        raise IdemError(
            f'the clouds of {len(doubled)} topics are in the frame {doubled[0]!r}; each sensor '
            'must have a frame of its own'
        )
    at, flaws, found = stamp_ns(row.messages[0]), [], []
    names = *row.names, *row.names[:1] * len(row.around)
    for name, message in zip(names, (*row.messages, *row.around), strict=True):
        try:
            measured = message and measured_in(message, point_times, prepare)
        except IdemError as error:
            flaws.append(f'{name} is left out: {error}')
            measured = None
        found.append(measured and (measured, (stamp_ns(message) - at) / SECOND))
    count = len(row.names)
    measured = tuple(each and each[0].later(each[1]) for each in found[:count])
    return Sighting(f'{at / SECOND:.3f} s', measured, tuple(filter(None, found[count:]))), flaws


def measured_in(message, point_times, prepare):
    """Return the `Measured` of a message, its times after its own stamp.

    Args:
        message: PointCloud2.
        point_times: `PointTimeConfig`.
        prepare: prepare(points, times) returns those that take part.

    Raises:
        IdemError: it cannot be used.
    """
    read = read_points(message, point_times)
    times = read.times.times
    return Measured(*prepare(read.points, np.zeros(len(read.points)) if times is None else times))


def preparing(config):
    """Return prepare(points, times) by a `PreprocessingConfig`, see `measured_in`."""

    def prepare(points, times):
        """Return the points that take part, and their times."""
        kept = preprocess(points, config)
        return kept.points, times[kept.kept]

    return prepare


def nearest(stamps, at, period):
    """Return the stamp nearest to a time, all [ns]; None: there is none within a period."""
    near = min(stamps, key=lambda stamp: abs(stamp - at), default=None)
    return None if near is None or abs(near - at) > period else near
