"""What a refinement looks like: the source where it was put, q_i, and a slice of q_tot around."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from idem_ros.core import Cloud, IdemError, q_per_point
from idem_ros.core.config import AUTO
from idem_ros.core.geometry.se3 import transform_points
from idem_ros.core.metric.cloud import as_cloud
from idem_ros.core.metric.landscape import Landscape, q_on_grid
from idem_ros.core.metric.region_of_interest import region_on_grid

STEPS = 25  # along each axis
REACH, WIDEST = 2.5, 10.0  # of the slice, in search radii: at least, at most
MOST_POINTS = 30_000  # of both clouds; of more, voxels grow by
COARSER = 1.5  # until there are no more


def points_of(cloud):
    """Return the points (N, 3) of a `Cloud` in its own frame."""
    return cloud.points + cloud.origin


def aligned_points(T_target_source, source):
    """Return the points (N, 3) of a `Cloud` in the target frame."""
    return transform_points(T_target_source, points_of(source))


def points_with_q(result, target, source, config):
    """Return the points of both clouds in the target frame, with what each adds to q_tot.

    Args:
        result: `RegistrationResult` of the two.
        target, source: `Cloud`s that took part.
        config: `RegistrationConfig` of the result; where it has a `voxel_size` the points are
            the voxel means, which q_tot is of.

    Returns:
        points (N + M, 3), q_i (N + M,) [nat] and (N + M,): 0 of the target, 1 of the source.
    """
    if (size := result.voxel_size) is not None:
        target, source = target.reduced(size), source.reduced(size)
    T = result.T_target_source
    points = np.concatenate([target.points + target.origin, aligned_points(T, source)])
    cloud = np.repeat([0.0, 1.0], [len(target), len(source)])
    if not result.radius > 0.0:  # too few points, or all in one place: nothing was evaluated
        return points, np.zeros(len(points)), cloud
    given = {'radius': result.radius, 'length_scale': config.length_scale}
    q = [
        each if len(each) == len(of) else each[of.finite]
        for each, of in zip(q_per_point(target, source, T, **given), (target, source), strict=True)
    ]
    return points, np.concatenate(q), cloud


class NoSlice(IdemError):
    """A result without a radius: there is nothing to evaluate around it."""


@dataclass(frozen=True)
class QTotSlice:
    """q_tot on a grid of shifts of the source around a pose."""

    shifts: NDArray
    """(S,), the same along x and y [m]."""
    q_tot: NDArray
    """(S, S) [nat]; rows: y."""
    voxel_size: float
    """Of the clouds it is evaluated on [m]."""
    radius: float
    """Of the neighbourhoods [m]."""

    @cached_property
    def region(self):
        """The `GridRegion` within the crown of maxima around the pose."""
        return region_on_grid(self.q_tot, self.step)

    @property
    def step(self):
        """Edge of a cell [m]."""
        return float(self.shifts[1] - self.shifts[0])

    def __str__(self):
        at_least = '' if self.region.closed else 'at least '
        steps = len(self.shifts)
        return (
            f'q_tot from {self.q_tot.min():.5g} nat (0) to {self.q_tot.max():.5g} nat (100) on '
            f'{steps} x {steps} cells of {self.step:.3g} m, radius {self.radius:.3g} m; the '
            f'region of interest covers {at_least}{self.region.measure:.3g} m2'
        )


def slice_of(refinement):
    """Evaluate q_tot of the clouds of a `Refinement` around their result; see `slice_around`.

    Raises:
        NoSlice: the result has no radius, as of too few points.
    """
    result, (target, source, config) = refinement.result, refinement.took_part
    if not result.radius > 0.0:
        raise NoSlice(f'the last result has no radius: its status is {result.status.value}')
    poses = result.T_target_source, refinement.T_guess
    config = replace(config, voxel_size=result.voxel_size)
    return slice_around(target, source, *poses, result.radius, config)


def slice_around(target, source, T_target_source, T_guess, radius, config, steps=STEPS):
    """Evaluate q_tot of two clouds of voxels around a pose, as far as the guess.

    Args:
        target, source: (N, 3) points, or `Cloud`s.
        T_target_source, T_guess: (4, 4).
        radius: of the result [m], above 0.
        config: `RegistrationConfig` of the result. Where its `voxel_size` is no number half the
            radius is taken; of clouds that are larger still, coarser voxels and a radius that
            suits them.
        steps: along each axis.

    Returns:
        `QTotSlice`
    """
    T = T_target_source
    target, source = (points_of(as_cloud(each)) for each in (target, source))
    offset = np.abs(T_guess[:2, 3] - T[:2, 3]).max()
    reach = np.clip(1.2 * offset, REACH * radius, WIDEST * radius)
    shifts = np.linspace(-reach, reach, steps)
    near = Cloud(within_reach(target, source, T, reach + 4 * radius)), Cloud(source)
    size = radius / 2 if config.voxel_size in (None, AUTO) else config.voxel_size
    clouds, size, radius = _reduced(near, size, radius)
    landscape = Landscape(*clouds, radius, config.length_scale, config.threads)
    q = q_on_grid(landscape, T, x=shifts, y=shifts).T
    return QTotSlice(shifts, q, size, landscape.radius)


def within_reach(target, source, T_target_source, margin):
    """Return the points (N, 3) of the target that a shifted source may reach; all if none is."""
    moved = transform_points(T_target_source, source)
    low, high = moved.min(axis=0) - margin, moved.max(axis=0) + margin
    inside = ((target >= low) & (target <= high)).all(axis=1)
    return target[inside] if inside.any() else target


def _reduced(clouds, voxel_size, radius):
    """Return both as voxels, of which size, and the radius; None: it has to suit the voxels."""
    reduced = [each.reduced(voxel_size) for each in clouds]
    while sum(map(len, reduced)) > MOST_POINTS:
        voxel_size, radius = COARSER * voxel_size, None
        reduced = [each.reduced(voxel_size) for each in clouds]
    return reduced, voxel_size, radius
