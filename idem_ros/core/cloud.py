"""A cloud prepared for the metric: what a rigid motion leaves alone, computed once and kept."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.blocks import in_threads, spans
from idem_ros.core.candidates import SKIN
from idem_ros.core.exceptions import InvalidCloud, InvalidConfig
from idem_ros.core.fourth_neighbor import mean_fourth_neighbor_distance
from idem_ros.core.grid import Grid, build_grid
from idem_ros.core.jit import kernel
from idem_ros.core.moments import TIE, own_moments
from idem_ros.core.noise import SAMPLE, thickness_and_members
from idem_ros.core.voxels import reduce_to_voxels

KEPT = 8  # results kept of each kind: enough for two schedules of four stages
CELL_MARGIN = 1.0 + 1e-9
FARTHEST = 1e12  # a coordinate beyond is no measurement, and would drown the others' digits
MIDDLE_SAMPLE = 64  # points, about, that the middle of a cloud is taken from
FINEST = 2.0**24  # voxels from the middle outwards: float32 tells no finer ones apart
UNIT = np.empty((0, 7))  # raw moments of points that stand for themselves


class Neighbourhoods(NamedTuple):
    """A cloud's points in the order of their cells, each with the moments of its own ball."""

    grid: Grid
    order: np.ndarray  # (N,): grid.points = points[order]
    raw: np.ndarray  # (N, 7) or (0, 7), in the same order
    unit_own: np.ndarray  # (N, 10): k, sum d, sum d d^T of the points
    raw_own: np.ndarray  # (N, 10): of the raw points that they stand for
    entropy: np.ndarray  # (N,): h of Eq. 4, of the points


class Cloud:
    """Points to register, with their own moments kept between calls.

    A target that does not change is made a `Cloud` once: later calls then cost nothing for it.

    Args:
        points: (N, 3) real numbers, N >= 1, in any unit of length; they are copied. Rows that are
            not finite, masked, or beyond 1e12, count in `dropped` and are left out of everything.

    Attributes:
        points: (K, 3) those that are left, minus `origin`.
        origin: (3,) the middle of the cloud.
        finite: (N,) bool: which of those given are left.
        dropped: how many are not.

    Raises:
        InvalidCloud: another shape, not numbers, or no finite point.
    """

    def __init__(self, points):
        points = _checked_points(points)
        # Moments are taken near the origin: at map coordinates (1e6 m) their digits would cancel.
        self.origin, self.finite, kept = _centred(points)
        self.dropped = len(points) - len(kept)
        if len(kept) == 0:
            raise InvalidCloud(
                f'the cloud has {len(points)} points and none is finite; at least one must be'
            )
        self._init_from(kept, UNIT)

    def _init_from(self, points, raw):
        self.points, self.raw = points, raw
        self._fourth_neighbor_distance = {}
        self._cells = {}
        self._neighbourhoods = {}
        self._reduced = {}
        self._thickness = {}

    def __len__(self):
        return len(self.points)

    def __repr__(self):
        return f'Cloud({len(self)} points)'

    def fourth_neighbor_distance(self, most=None):
        """Mean distance r_4th from a point to its fourth nearest neighbour, itself not counted.

        Of every point, or of every n-th, at least `most` of them; computed once.
        """
        if most not in self._fourth_neighbor_distance:
            if len(self) < 5:
                raise InvalidCloud(
                    f'a cloud of {len(self)} points has no fourth neighbour; '
                    'give a radius, or at least 5 points'
                )
            distance = mean_fourth_neighbor_distance(self.points, most)
            self._fourth_neighbor_distance[most] = distance
        return self._fourth_neighbor_distance[most]

    def thickness(self, radius):
        """Return how thick surfaces are in balls of a radius, and their members; computed once.

        Of a sample of the points.
        """
        if radius not in self._thickness:
            grid, _, raw = self.in_cells(radius)
            stride = max(len(self) // SAMPLE, 1)
            n = -(-len(self) // stride)
            unit_own, raw_own, entropy = np.empty((n, 10)), np.empty((n, 10)), np.empty(n)
            out = (unit_own, raw_own, entropy)
            own_moments(grid, raw, radius * radius * TIE, radius, 0, n, stride, *out)
            found = thickness_and_members(raw_own if len(raw) else unit_own)
            _keep(self._thickness, radius, found)
        return self._thickness[radius]

    def in_cells(self, radius):
        """Return a grid for balls up to a radius and its skin, its order, and the raw moments.

        Sorted once and kept; raw (N, 7) or (0, 7) is in the grid's order.
        """
        if radius not in self._cells:
            grid, order = build_grid(self.points, radius * (1.0 + SKIN) * CELL_MARGIN)
            raw = self.raw.take(order, axis=0) if len(self.raw) else UNIT
            _keep(self._cells, radius, (grid, order, raw))
        return self._cells[radius]

    def forget(self, radius):
        """Let go of the cells at a radius that no stage uses."""
        self._cells.pop(radius, None)

    def forget_reduced(self):
        """Let go of the coarser clouds: nobody can ask for them again."""
        self._reduced.clear()

    def crowding(self, radius):
        """Return how many points share the cell of a point, on average, in cells of the radius."""
        grid, _ = build_grid(self.points, radius)
        return float(np.sum(np.diff(grid.start).astype(np.float64) ** 2) / len(self))

    def reduced(self, voxel_size):
        """Return the cloud of voxel means, in this frame and with this origin; computed once.

        Each mean knows the moments of the points that it stands for.
        """
        if voxel_size not in self._reduced:
            cloud = Cloud.__new__(Cloud)
            mean, raw = reduce_to_voxels(self.points, self.raw, voxel_size)
            cloud.origin, cloud.finite, cloud.dropped = self.origin, np.ones(len(mean), bool), 0
            cloud._init_from(mean, raw)
            _keep(self._reduced, voxel_size, cloud)
        return self._reduced[voxel_size]

    def require_resolved(self, voxel_size):
        """Refuse voxels finer than single precision resolves the cloud's extent.

        Raises:
            InvalidConfig: it says how large they must be.
        """
        # half of the points: a stray, however far, says nothing of the extent
        sample = self.points[:: max(len(self) // MIDDLE_SAMPLE, 1)]
        extent = float(np.median(np.abs(sample).max(axis=1)))
        if extent / voxel_size > FINEST:
            raise InvalidConfig(
                f'voxel_size is {voxel_size:g}, but the cloud reaches {extent:.3g} from its '
                f'middle: it must be {extent / FINEST:.1g} at least, or none'
            )


def neighbourhoods(clouds, radius, scale, threads=1):
    """Return each cloud's own moments and entropies at a radius, of lengths over a scale.

    Computed once and kept with the cloud. Its grid serves balls up to the radius and its skin.
    """
    key = (radius, scale)
    new = [cloud for cloud in dict.fromkeys(clouds) if key not in cloud._neighbourhoods]
    found = in_threads(threads, lambda cloud: _unfilled(cloud, radius), new)
    blocks = [(own, *span) for own in found for span in spans(len(own.order))]
    in_threads(threads, lambda block: _fill(*block, radius * radius * TIE, scale), blocks)
    for cloud, own in zip(new, found, strict=True):
        _keep(cloud._neighbourhoods, key, own)
    return [cloud._neighbourhoods[key] for cloud in clouds]


def _unfilled(cloud, radius):
    grid, order, raw = cloud.in_cells(radius)
    unit_own, entropy = np.empty((len(cloud), 10)), np.empty(len(cloud))
    raw_own = np.empty((len(cloud), 10)) if len(raw) else unit_own
    return Neighbourhoods(grid, order, raw, unit_own, raw_own, entropy)


def _fill(own, begin, end, r2, scale):
    out = (own.unit_own, own.raw_own, own.entropy)
    own_moments(own.grid, own.raw, r2, scale, begin, end, 1, *out)


def as_cloud(points):
    """Return a `Cloud` as it is, and anything else made into one."""
    return points if isinstance(points, Cloud) else Cloud(points)


def _keep(kept, key, value):
    while len(kept) >= KEPT:
        kept.pop(next(iter(kept)))
    kept[key] = value


def _checked_points(points):
    try:
        masked = isinstance(points, np.ma.MaskedArray)
        array = points.astype(np.float64).filled(np.nan) if masked else np.asarray(points)
        if array.dtype.kind not in 'fiub':
            raise TypeError(f'its dtype is {array.dtype}')
    except (TypeError, ValueError) as error:
        raise InvalidCloud(f'the cloud is not an array of real numbers: {error}') from error
    if array.ndim != 2 or array.shape[1] != 3:
        more = ', as points[:, :3] is' if array.ndim == 2 and array.shape[1] > 3 else ''
        more = ', as points.T is' if array.ndim == 2 and array.shape[0] == 3 else more
        raise InvalidCloud(f'the cloud has shape {array.shape}; it must be (N, 3){more}')
    return np.ascontiguousarray(array, dtype=np.float64)


@kernel
def _centred(points):
    """Return the middle of the finite rows, which rows are, and these rows minus the middle.

    The median of a sample: a stray would drag the mean away, and with it the others' digits.
    """
    finite = np.empty(points.shape[0], np.bool_)
    n = 0
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        finite[i] = abs(x) < FARTHEST and abs(y) < FARTHEST and abs(z) < FARTHEST
        n += finite[i]
    kept = np.empty((n, 3))
    n = 0
    for i in range(points.shape[0]):
        if finite[i]:
            for c in range(3):
                kept[n, c] = points[i, c]
            n += 1
    origin = np.zeros(3)
    for c in range(3 * (n > 0)):
        sample = np.sort(kept[:: max(n // MIDDLE_SAMPLE, 1), c])
        origin[c] = sample[sample.shape[0] // 2]
        for i in range(n):
            kept[i, c] -= origin[c]
    return origin, finite, kept
