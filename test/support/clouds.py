"""Small clouds and motions that several tests use."""

import gc
from contextlib import contextmanager

import numpy as np

from idem_ros.core import Cloud
from idem_ros.core.geometry import se3


def surface(rng, n, noise=0.0):
    """A closed, bumpy surface of about unit size without symmetries, sampled at random."""
    d = rng.normal(size=(n, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    bumps = 0.2 * np.sin(3 * d[:, 0] + 1) * np.cos(4 * d[:, 1]) + 0.15 * np.sin(
        5 * d[:, 2] + d[:, 0]
    )
    return d * (1 + bumps)[:, None] * (1.0, 0.8, 0.6) + rng.normal(size=(n, 3)) * noise


def motion(rng, degrees, distance):
    """A transform of exactly this angle and length, in random directions."""
    axis, direction = rng.normal(size=3), rng.normal(size=3)
    transform = se3.exp(np.r_[np.deg2rad(degrees) * axis / np.linalg.norm(axis), np.zeros(3)])
    transform[:3, 3] = distance * direction / np.linalg.norm(direction)
    return transform


def error_of(transform, truth):
    """Angle [deg] and distance between two transforms."""
    difference = se3.inverse(truth) @ transform
    return np.rad2deg(se3.rotation_angle(difference)), np.linalg.norm(difference[:3, 3])


@contextmanager
def clouds_made_since():
    """Yield what returns the sizes of the clouds that were made within and are still alive."""
    gc.collect()
    gc.freeze()  # what is there already is not looked through each time
    try:
        yield lambda: [len(each) for each in gc.get_objects() if type(each) is Cloud]
    finally:
        gc.unfreeze()
