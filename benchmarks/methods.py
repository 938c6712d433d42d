"""IDEM and the methods of small_gicp behind one signature: prepare a case, solve from guesses."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from idem_ros.core import Cloud, register
from idem_ros.replay.peers import CRITERIA, NEIGHBOURS, small_gicp

IDEM = 'IDEM'
PEERS = ('ICP', 'PLANE_ICP', 'GICP', 'VGICP')
DISTANCES = (1.0, 3.0, 10.0, 30.0)
"""Correspondence distances to choose from, as multiples of the spacing."""
RESOLUTIONS = (0.75, 1.5, 3.0, 6.0)
"""Edges of VGICP's voxels to choose from, in spacings: some 1, 2, 4, 8 voxels of a LiDAR scan."""


class Setting(NamedTuple):
    """A method and what it leaves to its user to choose, in multiples of the spacing."""

    method: str
    distance: float | None = None
    resolution: float | None = None

    def __str__(self):
        if self.resolution is not None:
            return f'voxel {self.resolution:g}'
        return '' if self.distance is None else f'distance {self.distance:g}'


def settings(distances=DISTANCES, resolutions=RESOLUTIONS):
    """Return every `Setting` of the peers that is tried."""
    pointwise = [Setting(method, d) for method in PEERS[:3] for d in distances]
    # VGICP looks into one voxel only: its edge bounds the distance.
    return pointwise + [Setting('VGICP', max(distances), edge) for edge in resolutions]


def idem_solver(case, config):
    """Return solve(T_guess) -> (T_target_source, converged); the clouds are prepared once."""
    target, source = Cloud(case.target), Cloud(case.source)
    config = replace(config, voxel_size=case.voxel_size)

    def solve(T_guess):
        result = register(target, source, T_guess, config)
        return result.T_target_source, result.converged

    return solve


def peer_solvers(case, tried):
    """Yield (setting, solve) for each setting, `solve` as of `idem_solver`.

    Lengths are divided by the spacing first, so that small_gicp's damping and criteria mean the
    same on a bunny as in a street.
    """
    gicp = small_gicp()
    unit = case.spacing
    target, source = (_reduced(gicp, points, case) for points in (case.target, case.source))
    tree = gicp.KdTree(target)
    gicp.estimate_normals_covariances(target, tree, NEIGHBOURS)
    gicp.estimate_normals_covariances(source, gicp.KdTree(source), NEIGHBOURS)
    for setting in tried:
        matched = (target, source, tree)
        options = {'max_correspondence_distance': setting.distance, **CRITERIA}
        if setting.resolution is None:
            options['registration_type'] = setting.method
        else:
            voxels = gicp.GaussianVoxelMap(setting.resolution)
            voxels.insert(target)
            matched = (voxels, source)
        yield setting, _scaled_solver(gicp, matched, options, unit)


def _reduced(gicp, points, case):
    scaled = points / case.spacing
    if case.voxel_size is None:
        return gicp.PointCloud(scaled)
    return gicp.voxelgrid_sampling(scaled, case.voxel_size / case.spacing)


def _scaled_solver(gicp, matched, options, unit):
    def solve(T_guess):
        guess = np.array(T_guess)
        guess[:3, 3] /= unit
        result = gicp.align(*matched, init_T_target_source=guess, **options)
        T = np.array(result.T_target_source)
        T[:3, 3] *= unit
        return T, bool(result.converged)

    return solve
