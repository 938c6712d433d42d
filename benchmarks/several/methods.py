"""Poses of several clouds by each method: at once, by pairs in a chain, by a graph of pairs."""

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.case import Case
from benchmarks.methods import Setting, peer_solvers
from idem_ros.core import Cloud, PosePrior, register, register_all, solve_graph
from idem_ros.core.geometry import se3

JOINT, CHAIN, GRAPH, MULTIWAY = 'at once', 'chain of pairs', 'graph of pairs', 'multiway GICP'
DISTANCES = (1.0, 3.0)  # correspondence distances of GICP to choose from, in spacings


def solve_all(scene, config):
    """Return the `JointResult`, and {method: (K, 4, 4) poses}: multiway GICP at each `DISTANCES`.

    The graphs start from the truth, so that nothing but their edges decides.
    """
    clouds = [Cloud(points) for points in scene.clouds]
    edges = {pair: _registered(clouds, scene, pair, config) for pair in scene.pairs}
    count, joint = len(clouds), register_all(clouds, scene.starts, config)
    found = {
        JOINT: joint.poses,
        CHAIN: _chained([edges[min(k, k + 1), k + 1].T_target_source for k in range(count - 1)]),
    }
    weighed = [
        PosePrior(j, result.T_target_source, result.assessment.covariance, target=i)
        for (i, j), result in edges.items()
        if result.is_usable or j - i == 1
    ]
    found[GRAPH] = solve_graph(scene.truth, weighed).poses
    for distance in DISTANCES:
        found[MULTIWAY, distance] = _multiway(scene, distance)
    return joint, found


def _registered(clouds, scene, pair, config):
    i, j = pair
    guess = se3.inverse(scene.starts[i]) @ scene.starts[j]
    return register(clouds[i], clouds[j], guess, config)


def _chained(steps):
    poses = [np.eye(4)]
    for T in steps:
        poses.append(poses[-1] @ T)
    return np.array(poses)


def _multiway(scene, distance):
    """Return poses as Open3D's multiway registration has them, pairs by GICP.

    Each edge weighs as its correspondences do: the information of point-to-point distances.
    """
    edges = []
    for i, j in scene.pairs:
        guess = se3.inverse(scene.starts[i]) @ scene.starts[j]
        T = solved_by_gicp(scene, (i, j), guess, distance)
        information = _information(_case(scene, i, j), T, distance)
        edges.append(PosePrior(j, T, np.linalg.inv(information), target=i))
    return solve_graph(scene.truth, edges).poses


def solved_by_gicp(scene, pair, guess, distance):
    """Return where small_gicp's GICP puts the second cloud of a pair in the first."""
    ((_, solve),) = peer_solvers(_case(scene, *pair), [Setting('GICP', distance)])
    return solve(guess)[0]


def _case(scene, i, j):
    truth = se3.inverse(scene.truth[i]) @ scene.truth[j]
    return Case(f'{i}-{j}', scene.clouds[i], scene.clouds[j], truth, scene.voxel_size)


def _information(case, T, distance):
    """Return sum [I, -[x]x]^T [I, -[x]x] over the source's points that have a correspondence."""
    target, source = (
        Cloud(points).reduced(case.voxel_size) for points in (case.target, case.source)
    )
    placed = se3.transform_points(T, source.points + source.origin)
    tree = cKDTree(target.points + target.origin)
    near = tree.query(placed, distance_upper_bound=distance * case.spacing)[0]
    x = placed[np.isfinite(near)] - T[:3, 3]  # about the source's origin, as the covariance is
    information = 1e-9 * np.eye(6)
    information[:3, :3] += len(x) * np.eye(3)
    skew = se3.skew(x.sum(axis=0))
    information[3:, :3] += skew
    information[:3, 3:] += skew.T
    information[3:, 3:] += (x * x).sum() * np.eye(3) - x.T @ x
    return information
