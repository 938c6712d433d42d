"""A cloud prepared for the metric: what a rigid motion leaves alone, computed once and kept."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from idem_ros.core.exceptions import InvalidCloud
from idem_ros.core.grid import Grid, build_grid
from idem_ros.core.kernels import own_moments
from idem_ros.core.voxels import reduce_to_voxels

KEPT = 8  # neighbourhoods kept a cloud: three stages of two schedules, and the judged one
CELL_MARGIN = 1 + 1e-9  # a ball of the radius, ties included, reaches the next cell only


class Neighbourhoods(NamedTuple):
    """A cloud's points in the order of their cells, each with the moments of its own ball."""

    grid: Grid
    order: np.ndarray  # (N,): grid.points = points[order]
    moments: np.ndarray  # (N, 10): k, sum d, sum d d^T
    entropy: np.ndarray  # (N,): h of Eq. 4


class Cloud:
    """Points to register, with their own moments kept between calls.

    A target that does not change is made a `Cloud` once: later calls then cost nothing for it.
    The points are copied, and must not be changed afterwards.

    Args:
        points: (N, 3) real numbers, N >= 1, in any unit of length; rows that are not finite count
            in `dropped` and are left out of everything.

    Raises:
        InvalidCloud: another shape, not numbers, or no finite point.
    """

    def __init__(self, points):
        points = _checked_points(points)
        self.finite = np.isfinite(points).all(axis=1)
        self.dropped = int(len(points) - self.finite.sum())
        if not self.finite.any():
            raise InvalidCloud(
                f'the cloud has {len(points)} points and none is finite; at least one must be'
            )
        points = points[self.finite]
        # Moments are taken near the origin: at map coordinates (1e6 m) their digits would cancel.
        self.origin = points.mean(axis=0)
        self._init_from(points - self.origin, np.ones(len(points)), np.empty((0, 6)))

    def _init_from(self, points, weight, scatter):
        self.points, self.weight, self.scatter = points, weight, scatter
        self._fourth_neighbor_distance = None
        self._neighbourhoods = {}
        self._reduced = {}

    def __len__(self):
        return len(self.points)

    def __repr__(self):
        return f'Cloud({len(self)} points)'

    def fourth_neighbor_distance(self):
        """Mean distance r_4th from a point to its fourth nearest neighbour, itself not counted."""
        if self._fourth_neighbor_distance is None:
            if len(self) < 5:
                raise InvalidCloud(
                    f'a cloud of {len(self)} points has no fourth neighbour; '
                    'give a radius, or at least 5 points'
                )
            distance, _ = KDTree(self.points, balanced_tree=False).query(self.points, k=[5])
            self._fourth_neighbor_distance = float(distance.mean())
        return self._fourth_neighbor_distance

    def neighbourhoods(self, radius, scale):
        """Own moments and entropies at a radius, of lengths over a scale; computed once."""
        key = (radius, scale)
        if key not in self._neighbourhoods:
            grid, order = build_grid(self.points, self.weight, self.scatter, radius * CELL_MARGIN)
            moments, entropy = np.empty((len(self), 10)), np.empty(len(self))
            own_moments(grid, radius, scale, moments, entropy)
            self._keep(self._neighbourhoods, key, Neighbourhoods(grid, order, moments, entropy))
        return self._neighbourhoods[key]

    def voxel_means(self, voxel_size):
        """Return the cloud of voxel means, in this cloud's frame and origin; computed once."""
        return self._reduction(voxel_size)[0]

    def voxel_moments(self, voxel_size):
        """Return the voxel means that stand for all their points, with weight and scatter."""
        return self._reduction(voxel_size)[1]

    def _reduction(self, voxel_size):
        if voxel_size not in self._reduced:
            voxels = reduce_to_voxels(self.points, voxel_size)
            means = self._derived(voxels.mean, np.ones(len(voxels.mean)), np.empty((0, 6)))
            moments = self._derived(*voxels)
            self._keep(self._reduced, voxel_size, (means, moments))
        return self._reduced[voxel_size]

    def _derived(self, points, weight, scatter):
        cloud = Cloud.__new__(Cloud)
        cloud.finite, cloud.dropped, cloud.origin = np.ones(len(points), bool), 0, self.origin
        cloud._init_from(np.ascontiguousarray(points), weight, scatter)
        return cloud

    @staticmethod
    def _keep(kept, key, value):
        while len(kept) >= KEPT:
            kept.pop(next(iter(kept)))
        kept[key] = value


def as_cloud(points):
    """Return a `Cloud` as it is, and anything else made into one."""
    return points if isinstance(points, Cloud) else Cloud(points)


def _checked_points(points):
    try:
        array = np.asarray(points)
        if array.dtype.kind not in 'fiub':
            raise TypeError(f'its dtype is {array.dtype}')
    except (TypeError, ValueError) as error:
        raise InvalidCloud(f'the cloud is not an array of real numbers: {error}') from error
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidCloud(f'the cloud has shape {array.shape}; it must be (N, 3)')
    return array.astype(np.float64)
