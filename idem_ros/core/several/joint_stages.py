"""Several clouds prepared to be registered: voxels, the radius of Eq. 9, and the stages.

Every stage leaves out the pull along the surface: what two clouds bear, over several adds up, and
draws a ring of scans together.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.metric.entropy import TWO_PI_E_CUBED, length_unit
from idem_ros.core.metric.measured_points import require_resolved
from idem_ros.core.metric.moments import TIE
from idem_ros.core.metric.noise import widening_for
from idem_ros.core.metric.radii import SAMPLE, rounded, uncrowded
from idem_ros.core.metric.voxel_size import size_found
from idem_ros.core.solve.ball_cost import NOISE, BallCost
from idem_ros.core.tuning import SolverTuning
from idem_ros.core.workers import Workers, in_threads

# Of half the diagonal of a cloud's box: wider balls average away what holds a cloud in its place;
# rings of scans end drawn together from 0.22 on, and not yet at 0.18.
WIDEST_STAGE = 0.1
MOST_WIDENING = 1.5  # for noise: a ball has members of more clouds than two; 2 turns whole rings
MOST_POINTS = 4_000_000  # or voxels, of all clouds: some 2 GB


class JointStage(NamedTuple):
    """One minimisation."""

    radius: float
    voxel_size: float | None  # None: the clouds as they were prepared
    is_last: bool = False


def reduced_clouds(
    clouds: Sequence[Cloud], config: RegistrationConfig, workers: Workers
) -> list[Cloud]:
    """Return the clouds on the voxels of a config whose voxel size is known.

    Raises:
        InvalidConfig: voxels too fine for a cloud's extent, or too many of them.
    """
    size = size_found(config)
    if size is not None:
        for cloud in clouds:
            require_resolved(cloud.points, size)
        clouds = in_threads(workers, lambda cloud: cloud.reduced(size), clouds)
    count = sum(map(len, clouds))
    if count > MOST_POINTS:
        what = 'points' if size is None else f'voxels of {size:g}'
        raise InvalidConfig(
            f'{len(clouds)} clouds have {count} {what}; at most {MOST_POINTS} are registered at '
            'once: give a larger voxel_size, or fewer clouds'
        )
    return list(clouds)


def joint_stages(
    clouds: Sequence[Cloud], config: RegistrationConfig, tuning: SolverTuning, workers: Workers
) -> list[JointStage]:
    """Return the stages of prepared clouds, coarse to fine; none where all points coincide."""
    in_threads(workers, lambda cloud: cloud.fourth_neighbor_distance(SAMPLE), clouds)
    spacing = float(np.median([cloud.fourth_neighbor_distance(SAMPLE) for cloud in clouds]))
    wide = config.a * spacing  # Eq. 9 of clouds alike
    share = tuning.voxel_radius if all(cloud.is_reduced for cloud in clouds) else 1.0
    radius = rounded(config.radius_schedule[-1] * share * wide)
    if radius == 0.0:
        return []
    wider = _widening(clouds, radius, tuning, workers)
    last = JointStage(rounded(radius * wider), None, is_last=True)
    halves = [float(np.linalg.norm(np.subtract(*cloud.extent()))) / 2 for cloud in clouds]
    widest, finest = WIDEST_STAGE * float(np.median(halves)), size_found(config) or 0.0
    coarse = [(factor, rounded(factor * wide)) for factor in config.radius_schedule[:-1]]
    stages = [
        JointStage(radius, max(factor * finest, tuning.spacing * radius))
        for factor, radius in coarse
        if radius <= widest
    ]
    return [*stages, last]


def clouds_of_stage(
    clouds: Sequence[Cloud], stage: JointStage, config: RegistrationConfig, workers: Workers
) -> list[Cloud]:
    """Return the clouds on the voxels of a stage; in the last as they are, but for copies."""
    among_voxels = all(cloud.is_reduced for cloud in clouds)
    asked = config.a * config.radius_schedule[-1]

    def of_stage(cloud: Cloud) -> Cloud:
        """Return one on its voxels."""
        if stage.voxel_size is not None:
            return cloud.reduced(stage.voxel_size)
        return uncrowded(cloud, stage.radius, among_voxels, asked)

    return in_threads(workers, of_stage, clouds)


def joint_cost(
    stage: JointStage, config: RegistrationConfig, tuning: SolverTuning, among_voxels: bool
) -> BallCost:
    """Return the `BallCost` of a stage."""
    radius = stage.radius
    apart = tuning.apart if among_voxels else np.inf
    return BallCost(
        r2=radius * radius * TIE,
        c=TWO_PI_E_CUBED / length_unit(config.length_scale, radius) ** 6,
        noise=(NOISE * radius) ** 2,
        tangential=True,
        valued=False,
        apart2=(apart * radius) ** 2,
        curvature=1.0,
    )


def _widening(
    clouds: Sequence[Cloud], radius: float, tuning: SolverTuning, workers: Workers
) -> float:
    """Return by how much to widen balls for noise: `noise.widening` of clouds alike."""
    found = in_threads(workers, lambda cloud: cloud.thickness(radius), clouds)
    thickness, members = np.median(found, axis=0)
    wanted = widening_for(thickness, 2 * members, radius, tuning)
    return min(wanted, MOST_WIDENING)
