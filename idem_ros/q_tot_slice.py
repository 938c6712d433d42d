"""A slice of q_tot around a result, along x and y of the target frame, and what it encloses."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idem_ros.core import Cloud, IdemError
from idem_ros.core.displacement import q_on_grid
from idem_ros.core.landscape import Landscape
from idem_ros.core.region_of_interest import GridRegion, region_on_grid
from idem_ros.core.se3 import transform_points

STEPS = 25  # along each axis
REACH, WIDEST = 2.5, 10.0  # of the slice, in search radii: at least, at most
MOST_POINTS = 30_000  # of both clouds; of more, voxels grow by
COARSER = 1.5  # until there are no more


class NoSlice(IdemError):
    """A result without a radius: there is nothing to evaluate around it."""


@dataclass(frozen=True)
class QTotSlice:
    """q_tot on a grid of shifts of the source around a result."""

    shifts: NDArray
    """(S,), the same along x and y [m]."""
    q_tot: NDArray
    """(S, S) [nat]; rows: y."""
    radius: float
    """Of the neighbourhoods [m]."""
    region: GridRegion
    """What lies within the crown of maxima around the result."""

    @property
    def step(self):
        """Edge of a cell [m]."""
        return float(self.shifts[1] - self.shifts[0])

    def __str__(self):
        at_least = '' if self.region.closed else 'at least '
        return (
            f'q_tot from {self.q_tot.min():.5g} nat (0) to {self.q_tot.max():.5g} nat (100) on '
            f'{STEPS} x {STEPS} cells of {self.step:.3g} m, radius {self.radius:.3g} m; the '
            f'region of interest covers {at_least}{self.region.measure:.3g} m2'
        )


def slice_around(refinement, target, source, config):
    """Evaluate q_tot of two clouds around their result, as far as the guess.

    Args:
        refinement: `Refinement` of the two.
        target, source: `Cloud`s that took part.
        config: `RegistrationConfig` of the refinement. Without a `voxel_size` voxels of half the
            radius are taken; of clouds that are larger still, coarser ones and a radius to suit.

    Returns:
        `QTotSlice`

    Raises:
        NoSlice: the result has no radius, as of too few points.
    """
    result, radius = refinement.result, refinement.result.radius
    if not radius > 0.0:
        raise NoSlice(f'the last result has no radius: its status is {result.status.value}')
    T = result.T_target_source
    offset = np.abs(refinement.T_guess[:2, 3] - T[:2, 3]).max()
    reach = np.clip(1.2 * offset, REACH * radius, WIDEST * radius)
    shifts = np.linspace(-reach, reach, STEPS)
    near = _near(target.points + target.origin, source, T, reach + 4 * radius)
    clouds, radius = _reduced(near, source, radius, config.voxel_size or radius / 2)
    landscape = Landscape(*clouds, radius, config.length_scale, config.threads)
    q = q_on_grid(landscape, T, x=shifts, y=shifts).T
    return QTotSlice(shifts, q, landscape.radius, region_on_grid(q, shifts[1] - shifts[0]))


def _near(points, source, T_target_source, margin):
    """Return the points (N, 3) of the target that a shifted source may reach; all if none is."""
    around = transform_points(T_target_source, source.points + source.origin)
    low, high = around.min(axis=0) - margin, around.max(axis=0) + margin
    inside = ((points >= low) & (points <= high)).all(axis=1)
    return points[inside] if inside.any() else points


def _reduced(target_points, source, radius, voxel_size):
    target, source = Cloud(target_points), Cloud(source.points + source.origin)
    clouds = [each.reduced(voxel_size) for each in (target, source)]
    while sum(map(len, clouds)) > MOST_POINTS:
        voxel_size, radius = COARSER * voxel_size, None
        clouds = [each.reduced(voxel_size) for each in (target, source)]
    return clouds, radius
