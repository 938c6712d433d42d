"""A pose graph with our edges: scans of a drive, each registered to the two after it.

Each edge is weighed by its covariance: what a pair of scans does not determine weighs nothing.

Run it as `python examples/pose_graph.py`.
"""

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from idem_ros.core import Cloud, RegistrationConfig, register
from idem_ros.core.geometry.se3 import inverse
from idem_ros.simulation.drive import drive, perturbed
from idem_ros.simulation.lidar import Lidar, scan
from idem_ros.simulation.street import street

STOPS = 8
CONFIG = RegistrationConfig(voxel_size=0.5)


def edges_of(clouds, odometry):
    """Return [(i, j, T_i_j, root)] of each scan and the two after it; root.T whitens an edge."""
    edges = []
    pairs = {(i, min(i + step, STOPS - 1)) for i in range(STOPS - 1) for step in (1, 2)}
    for i, j in sorted(pairs):
        guess = inverse(odometry[i]) @ odometry[j]
        result = register(clouds[i], clouds[j], guess, CONFIG)
        print(f'{i}-{j}: {result.assessment.verdict.value}, overlap {result.overlap:.2f}')
        if result.is_usable:
            root = np.linalg.cholesky(np.linalg.inv(result.assessment.covariance))
            edges.append((i, j, result.T_target_source, root))
    return edges


def residuals(parameters, edges):
    """Return how far each edge is from its measurement, in its own standard deviations."""
    T = [np.eye(4), *map(_pose, parameters.reshape(-1, 6))]
    return np.concatenate(
        [_off(inverse(T[i]) @ T[j], T_i_j) @ root for i, j, T_i_j, root in edges]
    )


def _off(T, measured):
    """As the covariance has it: of the source's pose in the target frame, about its own origin."""
    turn = Rotation.from_matrix(T[:3, :3] @ measured[:3, :3].T).as_rotvec()
    return np.r_[T[:3, 3] - measured[:3, 3], turn]


def _pose(parameters):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec(parameters[3:]).as_matrix(), parameters[:3]
    return T


def main():
    """Print how far the odometry, and the graph, end from the truth."""
    rng = np.random.default_rng(3)
    scene, lidar = street(rng), Lidar()
    world = drive(scene, 40, rng)[:STOPS]
    truth = [inverse(world[0]) @ T for T in world]
    clouds = [Cloud(scan(scene, T, lidar, rng)) for T in world]
    odometry = [np.eye(4)]
    for i in range(1, STOPS):
        odometry.append(odometry[-1] @ perturbed(inverse(truth[i - 1]) @ truth[i], 0.5, 0.1, rng))
    start = [np.r_[T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_rotvec()] for T in odometry[1:]]
    edges = edges_of(clouds, odometry)
    solved = least_squares(residuals, np.concatenate(start), args=(edges,), x_scale='jac')
    graph = [np.eye(4), *map(_pose, solved.x.reshape(-1, 6))]
    for name, poses in {'odometry': odometry, 'graph': graph}.items():
        off = [np.linalg.norm(T[:3, 3] - P[:3, 3]) for T, P in zip(truth, poses, strict=True)]
        print(
            f'{name}: off by {1e3 * np.mean(off):.1f} mm in the mean, {1e3 * max(off):.1f} at most'
        )


if __name__ == '__main__':
    main()
