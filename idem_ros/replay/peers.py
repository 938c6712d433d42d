"""The methods of small_gicp in the place of IDEM's registration; IDEM's metric judges them."""

from dataclasses import dataclass, replace

import numpy as np

from idem_ros.core import IdemError, RegistrationResult, Status, register
from idem_ros.core.maps.target import in_reach, with_common_voxel_size
from idem_ros.core.metric.balls import between_origins, from_origins
from idem_ros.core.metric.entropy import length_unit
from idem_ros.core.metric.joint_cloud import differences
from idem_ros.core.metric.overlap import overlap_of
from idem_ros.refinement.refiner import Idem
from idem_ros.replay.settings import IDEM

SPACINGS = 3.0  # max_distance by default, in spacings of the target
LEAST_POINTS = 5  # a point and its four neighbours: what has no spacing cannot be registered
NEIGHBOURS = 10  # for normals and covariances: small_gicp's own default
# As tight as those of RegistrationConfig, lengths in spacings: the defaults of small_gicp
# (0.1 deg, 1 mm, 20 steps) stop short of its own optimum.
CRITERIA = {'max_iterations': 100, 'rotation_epsilon': 1e-5, 'translation_epsilon': 1e-4}


class PeersMissing(IdemError):
    """The methods to compare with are not installed."""


@dataclass(frozen=True)
class _Matched:
    """A target as small_gicp wants it, and the unit of length it was divided by."""

    of: tuple
    unit: float
    distance: float
    arguments: tuple


def small_gicp():
    """Return the module small_gicp.

    Raises:
        PeersMissing: it is not installed.
    """
    try:
        import small_gicp
    except ImportError as error:
        raise PeersMissing(
            'small_gicp, which IDEM is compared with, is not installed; '
            "it comes with the extra: pip install '.[bench]'"
        ) from error
    return small_gicp


def method_of(settings):
    """Return what registers by `Settings`: `Idem` or a `Peer`.

    Raises:
        PeersMissing: see `Peer`.
    """
    if settings.method == IDEM:
        return Idem()
    return Peer(settings.method, settings.max_distance)


class Peer:
    """One method of small_gicp, with the seam of `refinement.Idem`.

    It gets the very points that IDEM registers: reduced to the same voxels. Lengths are divided
    by the target's spacing (its mean distance to the fourth neighbour), so that small_gicp's
    damping and criteria mean the same for a bunny as in a street; so are clouds centred, whose
    digits would drown at map coordinates. A target is prepared once.

    Args:
        method: 'icp', 'plane_icp', 'gicp' or 'vgicp'.
        max_distance: how far a correspondence is looked for; the edge of the voxels of vgicp,
            which bounds it there [unit of the clouds]; None: 3 spacings of the target.

    Raises:
        PeersMissing: small_gicp is not installed.
    """

    def __init__(self, method, max_distance=None):
        self._gicp = small_gicp()
        self._method = method.upper()
        self._max_distance = max_distance
        self._matched = None

    solves_motion = False

    def register(self, target, source, T_target_source, config, twist=None, covariance=None):
        """Register as `core.register` does; q_tot, overlap and radius are for `judged` to say."""
        config = with_common_voxel_size(config, target, source)
        target = in_reach(target, source, T_target_source, config)
        result = self._registered(target, source, T_target_source, config)
        return replace(result, voxel_size=config.voxel_size)

    def _registered(self, target, source, T_target_source, config):
        target, source = _reduced(target, source, config)
        if min(len(target), len(source)) < LEAST_POINTS:
            return _unjudged(T_target_source, Status.TOO_FEW_POINTS)
        if target.fourth_neighbor_distance() == 0.0:
            return _unjudged(T_target_source, Status.DEGENERATE)
        matched = self._matched_to(target, config)
        guess = between_origins(target, source, T_target_source)
        guess[:3, 3] /= matched.unit
        first, *tree = matched.arguments
        found = self._gicp.align(
            first,
            self._prepared(source, matched.unit)[0],
            *tree,
            init_T_target_source=guess,
            max_correspondence_distance=matched.distance,
            num_threads=config.threads,
            **CRITERIA,
            **({} if self._method == 'VGICP' else {'registration_type': self._method}),
        )
        T = np.array(found.T_target_source)
        T[:3, 3] *= matched.unit
        if not np.isfinite(T).all() or found.num_inliers == 0:
            return _unjudged(T_target_source, Status.NO_OVERLAP, found.iterations)
        status = Status.CONVERGED if found.converged else Status.MAX_ITERATIONS
        return _unjudged(from_origins(target, source, T), status, found.iterations)

    def judged(self, result, target, source, config):
        """Return a result with q_tot, overlap and radius as IDEM would report them there."""
        T, config = result.T_target_source, replace(config, voxel_size=result.voxel_size)
        one_step = replace(config, radius_schedule=config.radius_schedule[-1:], max_iterations=1)
        radius = register(target, source, T, one_step).radius
        if radius == 0.0:  # nothing to evaluate: as `register` has it
            figures = 'q_tot', 'q_mean', 'overlap', 'overlap_source', 'overlap_target', 'radius'
            return replace(result, **dict.fromkeys(figures, 0.0))
        target, source = _reduced(target, source, config)
        pose, scale = between_origins(target, source, T), length_unit(config.length_scale, radius)
        (q_target, reach_target), (q_source, reach_source) = differences(
            target.points, source.points, pose, radius, scale
        )
        q = float(q_target.sum() + q_source.sum())
        within = np.count_nonzero(reach_target) + np.count_nonzero(reach_source)
        overlap = overlap_of(target, source, pose, radius, (reach_target, reach_source))
        return replace(
            result,
            q_tot=q,
            q_mean=q / within if within else 0.0,
            overlap=overlap.share,
            overlap_source=overlap.of_source,
            overlap_target=overlap.of_target,
            radius=radius,
        )

    def _matched_to(self, target, config):
        if self._matched is None or self._matched.of != (target, config.voxel_size):
            unit = target.fourth_neighbor_distance()
            distance = SPACINGS if self._max_distance is None else self._max_distance / unit
            cloud, tree = self._prepared(target, unit)
            arguments = (cloud, tree)
            if self._method == 'VGICP':
                voxels = self._gicp.GaussianVoxelMap(distance)
                voxels.insert(cloud)
                arguments = (voxels,)
            self._matched = _Matched((target, config.voxel_size), unit, distance, arguments)
        return self._matched

    def _prepared(self, cloud, unit):
        prepared = self._gicp.PointCloud(cloud.points / unit)
        tree = self._gicp.KdTree(prepared)
        if self._method != 'ICP':
            self._gicp.estimate_normals_covariances(prepared, tree, NEIGHBOURS)
        return prepared, tree


def _reduced(target, source, config):
    """Return the clouds that IDEM would register last."""
    if config.voxel_size is None:
        return target, source
    return tuple(cloud.reduced(config.voxel_size) for cloud in (target, source))


def _unjudged(T, status, iterations=0):
    unknown = np.full((6, 6), np.nan)
    return RegistrationResult(
        np.array(T),
        status,
        iterations,
        *[np.nan] * 4,
        unknown,
        overlap_source=np.nan,
        overlap_target=np.nan,
    )
