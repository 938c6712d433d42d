"""What scans are registered to: a cloud, all of which counts, or of a map what is in reach."""

from typing import cast

from idem_ros.core.arrays import Transform
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import InvalidCloud
from idem_ros.core.maps.map_cloud import MapCloud
from idem_ros.core.metric.cloud import Cloud, CloudLike, as_cloud
from idem_ros.core.metric.voxel_size import with_voxel_size, with_voxel_size_of
from idem_ros.core.tuning import SOLVER, SolverTuning
from idem_ros.core.workers import ALONE, Workers, in_threads

Target = Cloud | MapCloud
TargetLike = CloudLike | MapCloud


def as_target_and_source(
    target: TargetLike, source: TargetLike, threads: int = 1
) -> tuple[Target, Cloud]:
    """Return clouds and maps as they are, and anything else made into a `Cloud`, for one call.

    Both at once, where there are two threads.

    Raises:
        InvalidCloud: one is none, or the source is a map.
    """
    if isinstance(source, MapCloud):
        raise InvalidCloud('the source is a MapCloud; a map can only be the target')
    found = in_threads(Workers(threads), as_target, (target, source))
    return found[0], cast(Cloud, found[1])


def as_target(points: TargetLike) -> Target:
    """Return a `MapCloud` or a `Cloud` as it is, and anything else made into one, for one call."""
    return points if isinstance(points, MapCloud) else as_cloud(points)


def with_common_voxel_size(
    config: RegistrationConfig, target: Target, source: Cloud, tuning: SolverTuning = SOLVER
) -> RegistrationConfig:
    """Return a `RegistrationConfig` whose voxel size is a number or None, never "auto"."""
    if isinstance(target, MapCloud):
        return with_voxel_size_of(config, source, tuning)
    return with_voxel_size(config, target, source, tuning=tuning)


def in_reach(
    target: Target,
    source: Cloud,
    T_target_source: Transform,
    config: RegistrationConfig,
    workers: Workers = ALONE,
) -> Cloud:
    """Return what of a target a source can meet at a pose: of a map a part, which may be empty.

    See `MapCloud.in_reach`.
    """
    if isinstance(target, MapCloud):
        return target.in_reach(source, T_target_source, config, workers)
    return target
