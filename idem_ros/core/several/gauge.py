"""The frame of joint poses: a common motion of clouds that hang together changes no q_i."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Integers, Mask, Point, Points, Transforms
from idem_ros.core.geometry import se3
from idem_ros.core.several.joint_descent import Known


class Gauge(NamedTuple):
    """What stays, and the motions that put solved poses where it is."""

    fixed: Mask  # (K,): clouds whose poses are as given
    motions: Transforms  # (K, 4, 4): of each cloud, the same for all of a part

    def poses(self, solved: Transforms, origins: Points, given: Transforms) -> Transforms:
        """Return poses (K, 4, 4) of the clouds' frames; those fixed are as given, to the bit."""
        result = self.motions @ solved
        result[:, :3, 3] -= np.einsum('kij,kj->ki', result[:, :3, :3], origins)
        result[self.fixed] = given[self.fixed]
        return result

    def covariance(self, of_solved: Floats) -> Floats:
        """Return a covariance (6 K, 6 K), by frames' poses, in the axes of the gauge."""
        turned = np.zeros_like(of_solved)
        for k, R in enumerate(self.motions[:, :3, :3]):
            for at in (6 * k, 6 * k + 3):
                turned[at : at + 3] = R @ of_solved[at : at + 3]
        for k, R in enumerate(self.motions[:, :3, :3]):
            for at in (6 * k, 6 * k + 3):
                turned[:, at : at + 3] = turned[:, at : at + 3] @ R.T
        return turned


def gauge_of(
    part: Integers,
    known: Known,
    held: Sequence[int],
    numbers: Sequence[int],
    poses: tuple[Transforms, Transforms],
    offset: Point,
) -> Gauge:
    """Return the `Gauge`: each part has what is held in it, or its first cloud, where it was.

    Args:
        part: (K,) which part each cloud is in.
        known: what the solve was held by.
        held: the clouds that are to stay.
        numbers: those that the clouds were given by: the least is a part's first.
        poses: (K, 4, 4) each, at the start and where the solve ended.
        offset: (3,) that both were moved by, to be near zero.
    """
    fixed, motions = known.held.copy(), np.tile(se3.translation(offset), (len(part), 1, 1))
    start, end = poses
    for number in range(part.max() + 1):
        members = np.flatnonzero(part == number)
        if (known.held[members] | known.anchored[members]).any():
            continue
        stays = min(members.tolist(), key=lambda k: (k not in held, numbers[k]))
        fixed[stays] = True
        motions[members] = motions[stays] @ start[stays] @ se3.inverse(end[stays])
    return Gauge(fixed, motions)
