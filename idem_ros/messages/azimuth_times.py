"""When each point of a spinning LiDAR was measured, by the order of azimuths, where none says."""

import numpy as np

from idem_ros.messages.point_times import AUTO, STAMP_AT, NoTimes

TURN = 2.0 * np.pi
SMALL = np.radians(20.0)  # a step from point to point; larger ones lead to the next ring
CHANCE = np.radians(45.0)  # mean step; of points in any order it is 90 degrees
LEAST_TURN = 0.1  # turns, that neighbours make in all
ONE_TURN = 1.25  # turns, more than a sweep makes


def azimuth_times(points, rule):
    """Return the times of the points of a sensor that turns evenly about its z axis.

    They must be in the order of their azimuths, column after column or ring after ring: the first
    is of the sweep's begin, and the order tells which way the sensor turns.

    Args:
        points: (N, 3), in the sensor's frame.
        rule: has `turn`, what a whole turn lasts [s], and `stamp_at`; auto: begin.

    Returns:
        (N,) seconds after the stamp, and how they were found.

    Raises:
        NoTimes: they are in no such order.
    """
    azimuth = np.arctan2(points[:, 1], points[:, 0])
    steps = (np.diff(azimuth) + np.pi) % TURN - np.pi
    sizes = np.abs(steps)
    turned = float(steps[sizes < SMALL].sum()) / TURN
    if len(steps) == 0 or sizes.mean() > CHANCE or abs(turned) < LEAST_TURN:
        raise NoTimes('its points are not in the order of their azimuths')
    way = np.sign(turned)
    progress = way * np.concatenate([[0.0], np.cumsum(steps)]) / TURN
    if np.ptp(progress) <= ONE_TURN:  # column after column, or no whole turn
        progress -= progress.min()
    else:
        margin = float(np.median(sizes))  # rings begin at nearly the same azimuth
        progress = ((way * (azimuth - azimuth[0]) + margin) % TURN - margin) / TURN
    times = rule.turn * progress
    at = 'begin' if rule.stamp_at == AUTO else rule.stamp_at
    which = 'counterclockwise' if way > 0 else 'clockwise'
    said = f'by azimuth, {which}, {rule.turn:g} s a turn; the stamp is at their {at}'
    return times + STAMP_AT[at] * float(np.ptp(times)), said
