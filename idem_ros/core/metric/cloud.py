"""A cloud prepared for the metric: what a rigid motion leaves alone, computed once and kept."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from idem_ros.core.arrays import (
    Floats,
    Indices,
    Mask,
    MomentRows,
    Point,
    Points,
    Transform,
    Transforms,
    Weights,
)
from idem_ros.core.exceptions import InvalidCloud
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.fourth_neighbor import mean_fourth_neighbor_distance
from idem_ros.core.geometry.grid import CELL_MARGIN, Grid, bounds, build_grid, crowding
from idem_ros.core.geometry.undistortion import checked_times
from idem_ros.core.geometry.voxels import reduce_to_voxels, reduce_with_times
from idem_ros.core.metric.cached import Kept
from idem_ros.core.metric.candidates import SKIN
from idem_ros.core.metric.measured_points import (
    centred_points,
    checked_points,
    usual,
)
from idem_ros.core.metric.moments import AS_MEASURED, TIE, moments_around, turned_weights
from idem_ros.core.metric.noise import SAMPLE, thickness_and_members
from idem_ros.core.metric.voxel_size import Fit, fit_of
from idem_ros.core.tuning import SOLVER, SolverTuning
from idem_ros.core.workers import ALONE, Workers, in_threads, spans

Scalar = TypeVar('Scalar', bound=np.generic)

KEPT = 8  # results of each kind: enough for two schedules of four stages


class Cells(NamedTuple):
    """A cloud's points in the order of the cells they lie in."""

    grid: Grid
    order: Indices  # (N,): grid.points = points[order]
    weights: Weights  # (N, 7) or (1, 7): weight and scatter, in the same order


class Neighbourhoods(NamedTuple):
    """The same, each with the moments of the ball around it in its own cloud."""

    grid: Grid
    order: Indices
    weights: Weights
    unit: MomentRows  # (N, 10), each point counting once
    own: MomentRows  # (N, 10), with weight and scatter; the same array where all have one and none


class Cloud:
    """Points to register, with what belongs to them alone kept between calls.

    A target that does not change is made a `Cloud` once: later calls then cost nothing for it.
    Threads may share one: nothing of it can be written, and what is kept is kept once.

    Args:
        points: (N, 3) real numbers, N >= 1, in any unit of length; they are copied. Rows that are
            not finite, masked, beyond 1e12, or strays, see `near_the_rest`, count in `dropped`
            and are left out of everything.
        times: (N,) [s] from the cloud's stamp at which the points were measured, for a sensor
            that moved meanwhile; None: all at once.

    Attributes:
        points: (K, 3) those that are left, minus `origin`; read-only.
        origin: (3,) the middle of the cloud; read-only.
        finite: (N,) bool: which of those given are left; read-only.
        dropped: how many are not.
        times: (K,) of those that are left, or None; read-only.

    Raises:
        InvalidCloud: another shape, not numbers, no finite point, or a point without its time.
    """

    def __init__(self, points: ArrayLike, times: ArrayLike | None = None) -> None:
        origin, finite, kept = centred_points(points)
        self._init(origin, finite, kept, AS_MEASURED, KEPT)
        if times is not None:
            self.times = _read_only(checked_times(times, checked_points(points))[finite])

    @classmethod
    def for_one_call(cls, points: ArrayLike) -> Cloud:
        """Return a cloud that keeps the latest result of each kind only: nobody else will ask."""
        cloud = cls.__new__(cls)
        cloud._init(*centred_points(points), AS_MEASURED, 1)
        return cloud

    @classmethod
    def joined(cls, clouds: Sequence[Cloud], poses: Transforms) -> Cloud:
        """Return the union of clouds at poses (K, 4, 4); it, too, is for one call."""
        each = list(zip(clouds, poses, strict=True))
        points = [se3.transform_points(T, cloud._points + cloud.origin) for cloud, T in each]
        union = cls.for_one_call(np.concatenate(points))
        if any(cloud.is_reduced for cloud in clouds):
            weights = (np.broadcast_to(cloud._weights, (len(cloud), 7)) for cloud in clouds)
            turned = [turned_weights(T[:3, :3], w) for T, w in zip(poses, weights, strict=True)]
            union._weights = np.concatenate(turned)[union.finite]
        return union

    def _init(
        self, origin: Point, finite: Mask, points: Points, weights: Weights, kept: int
    ) -> None:
        # Kernels take the arrays themselves: of read-only ones each would be compiled once more.
        self._points, self._weights = points, weights
        self.points: Points = _read_only(points)
        self.origin: Point = _read_only(origin)
        self.finite: Mask = _read_only(finite)
        self.dropped = len(finite) - len(points)
        self.times: Floats | None = None
        self._kept = Kept(kept)

    def __len__(self) -> int:
        return len(self._points)

    def __repr__(self) -> str:
        return f'Cloud({len(self)} points)'

    @property
    def is_reduced(self) -> bool:
        """Whether the points are means of voxels, and stand for others."""
        return self._weights is not AS_MEASURED

    @property
    def is_part(self) -> bool:
        """Whether it is a part of a map, beside which there is more."""
        return False

    def around(
        self, source: Cloud, T: Transform, radius: float, workers: Workers = ALONE
    ) -> Cloud:
        """Return what a source can meet within a radius at T, between the origins: all of it.

        Raises:
            OutOfTime: of a part of a map, that the workers are late.
        """
        return self

    def bounds(self) -> tuple[Point, Point]:
        """Return the lowest and highest coordinates (3,), minus `origin`; computed once."""
        return self._kept.get('bounds', None, lambda: bounds(self._points))

    def extent(self) -> tuple[Point, Point]:
        """Return the same of the points that are not far from most: how wide the cloud is."""
        return self._kept.get('extent', None, lambda: bounds(usual(self._points)))

    def fourth_neighbor_distance(self, most: int | None = None) -> float:
        """Mean distance r_4th from a point to its fourth nearest neighbour, itself not counted.

        Of every point, or of every n-th, at least `most` of them; computed once.
        """
        if len(self) < 5:
            raise InvalidCloud(
                f'a cloud of {len(self)} points has no fourth neighbour; '
                'give a radius, or at least 5 points'
            )
        return self._kept.get(
            'spacing', most, lambda: mean_fourth_neighbor_distance(self._points, most)
        )

    def thickness(self, radius: float) -> tuple[float, float]:
        """Return how thick surfaces are in balls of a radius, and their members' weight.

        Of a sample of the points; computed once.
        """
        return self._kept.get('thickness', radius, lambda: self._thickness(radius))

    def _thickness(self, radius: float) -> tuple[float, float]:
        cells = self.in_cells(radius)
        stride = max(len(self) // SAMPLE, 1)
        centres = np.ascontiguousarray(cells.grid.points[::stride])
        unit, own = np.empty((2, len(centres), 10))
        moments_around(centres, cells.grid, cells.weights, radius * radius * TIE, unit, own)
        return thickness_and_members(own)

    def in_cells(self, radius: float) -> Cells:
        """Return the `Cells` for balls up to a radius and its skin; sorted once."""
        return self._kept.get('cells', radius, lambda: self._in_cells(radius))

    def _in_cells(self, radius: float) -> Cells:
        grid, order = build_grid(self._points, radius * (1.0 + SKIN) * CELL_MARGIN)
        weights = self._weights.take(order, axis=0) if self.is_reduced else self._weights
        return Cells(grid, order, weights)

    def crowding(self, radius: float) -> float:
        """Return how many points share the cell of a point, on average; see `in_cells`."""
        return crowding(self.in_cells(radius).grid)

    def voxel_fit(self, tuning: SolverTuning = SOLVER) -> Fit | None:
        """Return how the points fill voxels, a `Fit`, or None; computed once."""
        return self._kept.get('voxel_fit', tuning, lambda: fit_of(self._points, tuning))

    def reduced(self, voxel_size: float) -> Cloud:
        """Return the cloud of voxel means, in this frame and with this origin; computed once.

        Each mean has weight, scatter and mean time of the points that it stands for.
        """
        return self._kept.get('reduced', voxel_size, lambda: self._reduced(voxel_size))

    def ready_neighbourhoods(self, radius: float, workers: Workers) -> Neighbourhoods | None:
        """Return the `Neighbourhoods` at a radius, where they come from elsewhere; None: compute.

        Raises:
            OutOfTime: the workers are late.
        """
        return None

    def _reduced(self, voxel_size: float) -> Cloud:
        cloud, raw, times = Cloud.__new__(Cloud), (self._points, self._weights), None
        if self.times is None:
            mean, weights = reduce_to_voxels(*raw, voxel_size)
        else:
            (mean, weights), times = reduce_with_times(*raw, self.times, voxel_size)
        cloud._init(self.origin, np.ones(len(mean), bool), mean, weights, self._kept.most)
        cloud.times = None if times is None else _read_only(times)
        return cloud

    def moved_to(self, points: Points) -> Cloud:
        """Return a cloud of these points elsewhere, (K, 3) minus `origin`, each at its time."""
        cloud = Cloud.__new__(Cloud)
        cloud._init(self.origin, self.finite, points, self._weights, self._kept.most)
        cloud.times = self.times
        return cloud


CloudLike = ArrayLike | Cloud  # (N, 3) points, or a `Cloud` made of them


def neighbourhoods(
    clouds: Sequence[Cloud], radius: float, workers: Workers = ALONE
) -> list[Neighbourhoods]:
    """Return the `Neighbourhoods` of each cloud at a radius; computed once and kept with it.

    Raises:
        OutOfTime: the workers are late.
    """
    new = [c for c in dict.fromkeys(clouds) if not c._kept.has('neighbourhoods', radius)]
    made = {c: ready for c in new if (ready := c.ready_neighbourhoods(radius, workers))}
    new = [c for c in new if c not in made]
    cells = in_threads(workers, lambda cloud: cloud.in_cells(radius), new)
    found = [Neighbourhoods(*each, *_room_for_moments(each)) for each in cells]
    blocks = [(each, span) for each in found for span in spans(len(each.order), workers)]

    def fill(block: tuple[Neighbourhoods, tuple[int, int]]) -> None:
        """Fill the moments of a block of points."""
        of, (begin, end) = block
        centres, *moments = (rows[begin:end] for rows in (of.grid.points, of.unit, of.own))
        moments_around(centres, of.grid, of.weights, radius * radius * TIE, *moments)

    in_threads(workers, fill, blocks)
    made.update(zip(new, found, strict=True))

    def kept(cloud: Cloud) -> Neighbourhoods:
        """Return a cloud's; anew where it was let go of since it was looked up."""
        get = cloud._kept.get
        return get(
            'neighbourhoods', radius, lambda: made.get(cloud) or neighbourhoods([cloud], radius)[0]
        )

    return [kept(cloud) for cloud in clouds]


def _room_for_moments(cells: Cells) -> tuple[MomentRows, MomentRows]:
    unit = np.empty((len(cells.order), 10))
    return unit, np.empty_like(unit) if len(cells.weights) > 1 else unit


def as_cloud(points: CloudLike) -> Cloud:
    """Return a `Cloud` as it is, and anything else made into one, for one call."""
    return points if isinstance(points, Cloud) else Cloud.for_one_call(points)


def _read_only(array: NDArray[Scalar]) -> NDArray[Scalar]:
    view = array.view()
    view.flags.writeable = False
    return view
