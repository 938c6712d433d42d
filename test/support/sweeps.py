"""Clouds of a sensor that moves while it measures, with the time of each point."""

import numpy as np
from clouds import surface

from idem_ros.core.geometry import se3
from idem_ros.recording.messages import cloud_message

TWIST = np.array([1.5, -0.5, 0.2, 0.3, -0.2, 1.5])  # x y z rx ry rz a second
SWEEP = 0.1
START = 10**9
PERIOD = 10**8  # [ns] from sweep to sweep
FRAMES = 'map', 'lidar'


def driven(seconds):
    """The pose of a sensor that moves by `TWIST`, so many seconds after the start."""
    return se3.exp(TWIST[[3, 4, 5, 0, 1, 2]] * seconds)


def uneven(seconds):
    """The pose of one that speeds up, swings and turns, so that no twist is that of a sweep."""
    pose = driven(0.3 * seconds + 0.1 * np.sin(8.0 * seconds))
    pose[1, 3] += 0.15 * np.sin(25.0 * seconds)
    return pose


def points_of_sweep(rng, path, stamp, begin=0.0, duration=SWEEP, count=2500):
    """Points of the surface as the sensor saw them on its path, and their times [s]."""
    world = surface(rng, count, 0.003)
    at_stamp = se3.transform_points(se3.inverse(path((stamp - START) / 1e9)), world)
    world = world[np.argsort(np.arctan2(at_stamp[:, 1], at_stamp[:, 0]))]  # as sensors turn
    times = begin + duration * np.sort(rng.random(count))
    after_start = (stamp - START) / 1e9 + times
    seen = [
        se3.transform_points(se3.inverse(path(t)), p)
        for t, p in zip(after_start, world, strict=True)
    ]
    return np.array(seen), times


SPOILT = {  # what becomes of the times of a sweep, and what is said of it
    'constant': (lambda t: 0.0 * t, 'are the same'),
    'not finite': (lambda t: np.where(t > 0.05, np.nan, t), 'are not finite'),
    'unsorted': (lambda t: np.random.default_rng(1).permutation(t), 'in no order'),
    'of another sweep': (lambda t: t + 5.0, 'of another sweep'),
    'rolling over': (lambda t: (t + 0.95) % 1.0, 'roll over'),
    'longer than a second': (lambda t: 20.0 * t, 'no sweep lasts so long'),
    'missing': (None, 'no field of times'),
}


def sweep_message(rng, path, stamp, frame=FRAMES[1], timed=True, **sweep):
    """A PointCloud2 of a sweep; without `timed` nobody says when its points were measured.

    timed: may be the name of one of `SPOILT`, too.
    """
    points, times = points_of_sweep(rng, path, stamp, **sweep)
    spoilt = SPOILT[timed][0] if isinstance(timed, str) else (lambda t: t) if timed else None
    columns = None if spoilt is None else {'time': spoilt(times)}
    return cloud_message(points, stamp, frame, columns=columns)


def map_message(rng, count=6000):
    return cloud_message(surface(rng, count, 0.003), START, FRAMES[0])
