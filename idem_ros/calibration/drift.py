"""How far a sensor is from where an earlier calibration had it, and whether that is by chance."""

from typing import NamedTuple

import numpy as np
from scipy import stats

from idem_ros.calibration.frame_tree import UnknownStart, bare
from idem_ros.calibration.fusion import SIGMAS, difference


class Drift(NamedTuple):
    """How far one sensor is from where it was."""

    name: str
    metres: float
    degrees: float
    sigmas: float
    """As improbable as so many standard deviations of one normal number."""

    @property
    def has_moved(self):
        """Whether it is farther off than chance has it."""
        return self.sigmas > SIGMAS

    def __str__(self):
        return f'{self.metres:.3g} m and {self.degrees:.2g} deg, {self.sigmas:.2g} sigma'


def drift_of(name, found, before, covariance):
    """Return the `Drift` of a sensor.

    Args:
        name: of the sensor.
        found: its `Fused`.
        before: (4, 4) where it was, in the frame of the same reference.
        covariance: (6, 6) of that, in the axes of the reference; zero where it is exact.
    """
    off = difference(found.pose, before)
    square = off @ np.linalg.solve(found.covariance + covariance, off)
    sigmas = stats.norm.isf(0.5 * stats.chi2.sf(square, 6))
    if np.isinf(sigmas):  # the probability is below the least number; it comes to the same
        sigmas = np.sqrt(square)
    distance, degrees = np.linalg.norm(off[:3]), np.degrees(np.linalg.norm(off[3:]))
    return Drift(name, float(distance), float(degrees), float(sigmas))


def covariances_of(tree, names):
    """Return (S, 6, 6) of sensors in the frame of the first by a `FrameTree`; zero where exact.

    Raises:
        UnknownStart: covariances are given in the frame of another sensor.
    """
    found = np.zeros((len(names), 6, 6))
    for s, name in enumerate(names):
        given = tree.covariances.get(bare(name))
        if s == 0 or given is None:
            continue
        if tree.parent_of(name) != bare(names[0]):
            raise UnknownStart(
                f'{tree.source} has {name} in the frame of {tree.parent_of(name)!r}, and '
                f'{names[0]!r} is the reference: take that of the file'
            )
        found[s] = given
    return found
