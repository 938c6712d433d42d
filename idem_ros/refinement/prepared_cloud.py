"""A cloud on its way from a message to what is registered; targets prepared once.

A target far larger than a scan is prepared as a map.
"""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter_ns
from typing import Any

import numpy as np

from idem_ros.core import Cloud, IdemError, MapCloud
from idem_ros.core.geometry.se3 import transform_points
from idem_ros.messages.pointcloud2 import PointsRead, read_points
from idem_ros.pairing.map_target import MapTarget
from idem_ros.pairing.pair import named
from idem_ros.pairing.targets import UnusableTarget
from idem_ros.refinement.preprocessing import Preprocessed, preprocess

KEPT = 2  # the one in use, and the one that comes next
LARGE = 500_000  # points: no scan of one sensor has more
WIDER = 1.5  # than the scan: a target of which most lies beyond
NARROWER = 0.1  # than the scan: a map in kilometres or degrees
OUTERMOST = 0.02  # of a cloud's points at each end say nothing of how wide it is
SAMPLE = 2000
AROUND = 10.0  # [m] of a pose that has no height: there its ground is looked for
LOWEST = 0.05  # of the points there are on the ground


@dataclass(frozen=True)
class PreparedCloud:
    """A cloud as it was read, what of it takes part, and that prepared."""

    read: PointsRead
    preprocessed: Preprocessed
    cloud: Cloud | MapCloud
    reading_ms: float
    preparing_ms: float

    def __len__(self):
        """Return how many points take part."""
        return len(self.preprocessed.points)

    @property
    def times(self):
        """The times (N,) of the cloud's points; None: all at once, as of a map."""
        return None if isinstance(self.cloud, MapCloud) else self.cloud.times


def prepared(
    role, message, preprocessing, point_times=None, make: Callable[..., Cloud | MapCloud] = Cloud
) -> PreparedCloud:
    """Read a PointCloud2 and prepare what of it takes part.

    Args:
        role: 'target' or 'source', which errors name.
        message: see `read_points`.
        preprocessing: `PreprocessingConfig`.
        point_times: `PointTimeConfig`; None: times of points are not read.
        make: what of (N, 3) points and their times, or None, makes a cloud.

    Raises:
        IdemError: it cannot be read, or no point takes part.
    """
    watch = Stopwatch()
    read = named(role, read_points, message, point_times)
    reading_ms = watch.lap()
    kept = named(role, preprocess, read.points, preprocessing, role == 'target')
    times = None if read.times.times is None else read.times.times[kept.kept]
    cloud = named(role, make, kept.points, times)
    return PreparedCloud(read, kept, cloud, reading_ms, watch.lap())


def left_out(*clouds) -> dict[str, Any]:
    """Return {why: how many points of `PreparedCloud`s take no part}, as `Refinement` has it."""
    return {
        'dropped_nonfinite': sum(each.read.dropped_nonfinite for each in clouds),
        'dropped_zero': sum(each.read.dropped_zero for each in clouds),
        'dropped_stray': sum(each.read.dropped_stray for each in clouds),
        'cropped': sum(each.preprocessed.cropped for each in clouds),
        'thinned': sum(each.preprocessed.thinned for each in clouds),
    }


class Stopwatch:
    """Times stages one after the other."""

    def __init__(self):
        self._since = perf_counter_ns()

    def lap(self) -> float:
        """Return the time since it was made, or since the last lap [ms]."""
        before, self._since = self._since, perf_counter_ns()
        return (self._since - before) / 1e6


class PreparedTargets:
    """What was prepared of the last targets; from several threads."""

    def __init__(self):
        self._kept = ()  # of ((message, settings of clouds), prepared), the newest last
        self._wide: Any = None, None  # a prepared scan that turned out to be a map, and that
        self._may_expect = True
        self._used, self._uses, self._is_stream = None, 0, False

    @property
    def kept(self):
        """The `PreparedCloud`s at hand."""
        return [target for _, target in self._kept]

    def of(self, message, of_clouds):
        """Return the `PreparedCloud` of a target, be it prepared now.

        Args:
            message: PointCloud2, or `MapTarget`.
            of_clouds: `PreprocessingConfig` and what else `prepared` takes.

        Raises:
            UnusableTarget: it cannot be used.
        """
        self._may_expect = True
        return self._of(message, of_clouds)

    def _of(self, message, of_clouds):
        for (kept, of), target in self._kept:
            if kept is message and of == of_clouds:
                return target
        try:
            target = _prepared(message, of_clouds)
        except IdemError as error:
            raise UnusableTarget(str(error)) from error
        others = [each for each in self._kept if each[0][0] is not message]
        self._kept = (*others[1 - KEPT :], ((message, of_clouds), target))
        return target

    def expect(self, message, of_clouds):
        """Prepare a target that no source was paired with yet: one after each that was asked for.

        Of many that come for nothing few are so prepared.

        Args:
            message, of_clouds: see `of`.

        Returns:
            Its cloud; None where it is not prepared.

        Raises:
            UnusableTarget: it cannot be used.
        """
        if not self._may_expect:
            return None
        self._may_expect = False
        return self._of(message, of_clouds).cloud

    def cloud_for(self, target, source, frames):
        """Return what a source is registered to: a map, where most of it lies beyond the source.

        Of targets that each serve one source, a stream of scans, only the first may be a map.

        Args:
            target: `PreparedCloud`.
            source: `Cloud` of the scan.
            frames: of both; where they are one, both are scans.

        Raises:
            UnusableTarget: it is a map far smaller than the scan.
        """
        if isinstance(target.cloud, MapCloud):
            _require_same_unit(target.cloud, source)
            return target.cloud
        if frames[0] == frames[1] or self._are_scans(target):
            return target.cloud
        is_map = self._wide[0] is target
        if not is_map and _width(_span(target.cloud)) > WIDER * _width(_span(source)):
            self._wide, is_map = (target, MapCloud(target.preprocessed.points)), True
        return self._wide[1] if is_map else target.cloud

    def _are_scans(self, target):
        """Note that a target is used; return whether the one before was used once: a stream."""
        if self._used is not target:
            self._is_stream = self._used is not None and self._uses < 2
            self._used, self._uses = target, 0
        self._uses += 1
        return self._is_stream


def _prepared(message, of_clouds):
    if not isinstance(message, MapTarget):
        return prepared('target', message, *of_clouds, make=_made)
    nothing = np.empty((0, 3))
    kept = Preprocessed(nothing, 0, 0, slice(0))
    return PreparedCloud(PointsRead(nothing, 0, 0), kept, MapCloud(message.map), 0.0, 0.0)


def _made(points, times):
    return MapCloud(points) if len(points) > LARGE else Cloud(points, times)


def _require_same_unit(map_, source):
    """Refuse a `MapCloud` that is far smaller than a scan.

    Raises:
        UnusableTarget: it says how wide both are.
    """
    wide, scan = _width(map_.bounds), _width(_span(source))
    if wide < NARROWER * scan:
        raise UnusableTarget(
            f'target: the map is {wide:.3g} wide, and the scan {scan:.3g}; is the map in '
            'kilometres, or in degrees?'
        )


def on_the_ground(map_, source, T):
    """Return a pose without height, such as RViz gives, where a scan meets the ground of a map.

    Args:
        map_: `MapCloud`.
        source: `Cloud` of the scan.
        T: (4, 4) with z = 0.
    """
    points = transform_points(T, source.points + source.origin)
    here = T[:2, 3]
    near = points[(np.abs(points[:, :2] - here) < AROUND).all(axis=1)]
    low, high = map_.bounds.copy()
    low[:2], high[:2] = here - AROUND, here + AROUND
    ground = map_.source.points_within(low, np.nextafter(high, np.inf))
    if len(near) == 0 or len(ground) == 0:
        return T
    placed = T.copy()
    placed[2, 3] = np.quantile(ground[:, 2], LOWEST) - np.quantile(near[:, 2], LOWEST)
    return placed


def prepare_ahead(target, map_, source, T, T_ahead):
    """Have a map prepared where scans come next, and forgotten where they do not.

    Args:
        target: `MapCloud`.
        map_: `MapSource` that it is of; None: all of it is kept.
        source: `Cloud` of the scan.
        T: (4, 4) where it is.
        T_ahead: (4, 4) where it is about to be.
    """
    span = _span(source)
    here, there = (transform_points(each, span.mean(axis=0)[None])[0] for each in (T, T_ahead))
    reach = (_width(span) + np.linalg.norm(there - here)) / 2
    center = (here + there) / 2
    target.prefetch(center, reach)
    if map_ is not None:
        map_.keep_near(center, reach)


def _span(source):
    """Return the lowest and highest coordinates (2, 3) of a `Cloud`, without its outermost."""
    sample = source.points[:: max(len(source) // SAMPLE, 1)] + source.origin
    return np.quantile(sample, (OUTERMOST, 1.0 - OUTERMOST), axis=0)


def _width(span):
    """Return the diagonal of a box (2, 3) as seen from above."""
    return float(np.linalg.norm(span[1, :2] - span[0, :2]))
