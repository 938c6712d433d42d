"""A map to register scans to: a scan costs what it can reach of it, however large the map is."""

from __future__ import annotations

import math
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from threading import Lock
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Floats, Point, Transform
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.geometry import se3
from idem_ros.core.maps.map_blocks import BlockSource, Level, MapBlocks
from idem_ros.core.maps.map_part import MapPart, Place
from idem_ros.core.maps.point_blocks import PointBlocks
from idem_ros.core.maps.reach import Reach
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.metric.measured_points import require_resolved
from idem_ros.core.metric.voxel_size import size_found, with_voxel_size_of
from idem_ros.core.workers import ALONE, Workers

CACHE_BYTES = 1 << 29  # some two million voxels with their moments
VOXELS_PER_EDGE = 64  # of a block
WIDER = 1.25  # of the balls that a stage has, about: how far beyond the scan it may look
MOVES = 2.0  # voxels, or spacings: how far a scan may move before another part is asked for
LEAST_POINTS = 5  # that have a spacing
SAMPLE = 512  # points that tell a scan's spacing
DONE = object()


class MapCloud:
    """A map that `register` takes as its target, prepared where scans come.

    Its blocks, cubes of 64 voxels, are prepared when a scan first reaches them and kept as far as
    they fit; those that a scan cannot reach are not looked at. A result is the same, to the bit,
    whether blocks were prepared before or not, and whatever the map holds farther than 80 voxels
    from all points of the scan, at its guess and on its way from there. Threads may share one.

    Args:
        points: (N, 3) real numbers, which are copied, or a `BlockSource`.
        cache_bytes: of the blocks that are kept, about.

    Raises:
        InvalidCloud: points of another shape, not numbers, or without a finite one.
    """

    def __init__(self, points: ArrayLike | BlockSource, cache_bytes: int = CACHE_BYTES) -> None:
        is_source = hasattr(points, 'points_within')
        self.source = (
            cast(BlockSource, points) if is_source else PointBlocks(cast(ArrayLike, points))
        )
        self._blocks = MapBlocks(self.source, cache_bytes)
        self._request = 0
        self._lock = Lock()
        self._thread: ThreadPoolExecutor | None = None

    def __repr__(self) -> str:
        low, high = self.bounds
        return f'MapCloud({low} to {high})'

    @property
    def bounds(self) -> Floats:
        """The lowest and highest coordinates (2, 3)."""
        return self.source.bounds

    @property
    def bytes(self) -> int:
        """How much memory the blocks take that are kept."""
        return self._blocks.bytes

    def in_reach(
        self,
        source: Cloud,
        T_target_source: Transform,
        config: RegistrationConfig,
        workers: Workers = ALONE,
    ) -> MapPart:
        """Return what of the map a scan at a pose can meet: a `Cloud`, which may have no point.

        What is prepared ahead ends with the piece it is at: two threads of Python wait for each
        other at every step, and whoever registers asks for it again afterwards.

        Args:
            source: the scan's `Cloud`.
            T_target_source: (4, 4).
            config: `RegistrationConfig`; a voxel size "auto" is what suits the scan.
            workers: for blocks that are yet to be prepared.

        Raises:
            OutOfTime: the workers are late.
            InvalidConfig: voxels finer than single precision resolves the scan's extent.
        """
        with self._lock:
            self._request += 1
        size = size_found(with_voxel_size_of(config, source))
        if size is not None:
            require_resolved(source.points, size)
            source = source.reduced(size)
        spacing = source.fourth_neighbor_distance(SAMPLE) if len(source) >= LEAST_POINTS else 0.0
        step = size if size is not None else 2.0 ** round(math.log2(spacing or 1.0))
        edge, widest = VOXELS_PER_EDGE * step, config.a * spacing * config.radius_schedule[0]
        narrowest = config.a * spacing * config.radius_schedule[-1]
        points = se3.transform_points(T_target_source, source.points + source.origin)
        distance = MOVES * step + WIDER * narrowest
        reach = Reach.around(points, edge, distance, self.bounds)
        near: Point = np.asarray(reach.zero * (edge / reach.per_edge), dtype=np.float64)
        T = T_target_source.copy()
        T[:3, 3] += T[:3, :3] @ source.origin - near
        place = Place(reach, T, near, WIDER * widest, MOVES * step)
        return MapPart(self._blocks, Level(edge, size, size), place, workers)

    def prefetch(self, center: ArrayLike, reach: float) -> Future[None]:
        """Prepare, in a thread of its own, what scans around a place will ask for; do not wait.

        As far as earlier scans have shown what that is. A later call takes the place of this one,
        the next scan ends it: it is for the time between two.

        Args:
            center: (3,) in the map's frame.
            reach: how far from it blocks are prepared, in the map's unit.

        Returns:
            A future that is done when the blocks are prepared, a later call has come, or a scan
            to be registered; with the source's error where it could not be read.
        """
        ahead = self._blocks.prepared_around(np.asarray(center, dtype=np.float64), reach)
        done: Future[None] = Future()
        with self._lock:
            self._request += 1
            if self._thread is None:
                self._thread = ThreadPoolExecutor(1, thread_name_prefix='idem_map')
        self._thread.submit(self._go_ahead, ahead, self._request, done)
        return done

    def _go_ahead(self, ahead: Iterator[object], request: int, done: Future[None]) -> None:
        """Prepare a piece of a block, and come back for the next: who ends waits for no more."""
        assert self._thread is not None, 'it runs this'
        try:
            if request == self._request and next(ahead, DONE) is not DONE:
                self._thread.submit(self._go_ahead, ahead, request, done)
            else:
                done.set_result(None)
        except Exception as error:  # also that the interpreter ends
            done.set_exception(error)
