"""Poses to be judged, right and wrong by known amounts, and what the judges see of each."""

from typing import NamedTuple
from zlib import crc32

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.case import displaced, errors
from idem_ros.core import Cloud, RegistrationConfig, register
from idem_ros.core.geometry import se3
from idem_ros.replay.peers import NEIGHBOURS, small_gicp

RIGHT_DEG, RIGHT = 1.0, 0.5  # of the spacing
WRONG_DEG, WRONG = 3.0, 1.5  # what is neither is not counted, but how many is told
LIDAR_MOVED = (0.57, 0.1)  # [deg], [m]
OBJECT_MOVED = (1.0, 0.5)  # [deg], of the spacing
LARGEST_OBJECT = 1.0  # [m], of the spread of its points
# starts: name, how many, least and most [deg], least and most over the spacing, stages
STARTS = (
    ('near', 5, 0.0, 15.0, 0.0, 8.0, (8.0, 4.0, 2.0, 1.0)),
    ('far', 7, 20.0, 180.0, 0.0, 60.0, (8.0, 4.0, 2.0, 1.0)),
    ('last stage', 8, 0.0, 40.0, 0.0, 15.0, (1.0,)),
)
NUMBERS = ('near_discord', 'contrast', 'overlap', 'way')  # what a model judges by
PEER_SCORES = ('inlier RMSE', 'fitness', 'GICP error')
DISTANCE = 1.0  # of the spacing, for the peers' correspondences


class Judged(NamedTuple):
    """One pose, whether it is right, and what is seen of it."""

    kind: str
    how: str  # the name of its start
    right: bool | None  # None: neither right nor clearly wrong
    near_discord: float
    contrast: float
    overlap: float
    way: float
    p_aligned: float
    free: str  # motions that nothing holds, in words
    peers: tuple[float, ...]  # as PEER_SCORES, the higher the better


def judged_poses(kind, build):
    """Return the `Judged` poses of one case: solved from near and far."""
    case = build()
    rng = np.random.default_rng(crc32(case.name.encode()))
    target, source = Cloud(case.target), Cloud(case.source)
    peers = _peers(case)
    found = []

    def judge(how, right, T, seen):
        numbers = *(getattr(seen, name) for name in NUMBERS), seen.p_aligned, seen.free
        found.append(Judged(kind, how, right, *numbers, peers(T)))

    for how, count, *ranges, stages in STARTS:
        of_start = RegistrationConfig(voxel_size=case.voxel_size, radius_schedule=stages)
        for _ in range(count):
            degrees, multiple = rng.uniform(*ranges[:2]), rng.uniform(*ranges[2:])
            off = degrees, multiple * case.spacing, rng
            start = displaced(case.truth, case.centroid, *off)
            result = register(target, source, start, of_start)
            T = result.T_target_source
            judge(how, _is_right(case, T), T, result.assessment)
    return found


def _is_right(case, T):
    degrees, distance = errors(case, T)
    distance /= case.spacing
    if degrees < RIGHT_DEG and distance < RIGHT:
        return True
    return False if degrees > WRONG_DEG or distance > WRONG else None


def moved_by(case):
    """Return how far displaced poses of a case are off, [deg] and [m]."""
    if np.linalg.norm(case.source.std(axis=0)) > LARGEST_OBJECT:
        return LIDAR_MOVED
    return OBJECT_MOVED[0], OBJECT_MOVED[1] * case.spacing


def _peers(case):
    """Return what gives the scores that peers offer, of a pose, all such that higher is better."""
    gicp, unit = small_gicp(), case.spacing
    clouds = [gicp.PointCloud(points / unit) for points in (case.target, case.source)]
    if case.voxel_size is not None:
        clouds = [gicp.voxelgrid_sampling(cloud, case.voxel_size / unit) for cloud in clouds]
    target, source = clouds
    tree = gicp.KdTree(target)
    for cloud in clouds:
        gicp.estimate_normals_covariances(cloud, gicp.KdTree(cloud), NEIGHBOURS)
    points = cKDTree(np.array(target.points())[:, :3])
    moving = np.array(source.points())[:, :3]

    def scores(T):
        scaled = np.array(T)
        scaled[:3, 3] /= unit
        distance, _ = points.query(se3.transform_points(scaled, moving))
        near = distance[distance < DISTANCE]
        result = gicp.align(
            target,
            source,
            tree,
            init_T_target_source=scaled,
            registration_type='GICP',
            max_correspondence_distance=DISTANCE,
            max_iterations=1,
        )
        rmse = float(np.sqrt(np.mean(near**2))) if len(near) else DISTANCE
        # the error is that at the start of the one step
        return -rmse, len(near) / len(moving), -result.error / max(result.num_inliers, 1)

    return scores
