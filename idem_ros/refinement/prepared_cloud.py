"""A cloud on its way from a message to what is registered, and what each stage takes."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter_ns
from typing import Any

from idem_ros.core import Cloud, MapCloud
from idem_ros.messages.pointcloud2 import PointsRead, read_points
from idem_ros.pairing.pair import named
from idem_ros.refinement.preprocessing import Preprocessed, preprocess


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
