"""A pose graph with our edges: scans of a drive, each registered to the two after it.

Each edge is weighed by its covariance: what a pair of scans does not determine weighs nothing.

Run it as `python examples/pose_graph.py`.
"""

import numpy as np

from idem_ros.core import Cloud, PosePrior, RegistrationConfig, register, solve_graph
from idem_ros.core.geometry.se3 import inverse
from idem_ros.simulation.drive import drive, perturbed
from idem_ros.simulation.lidar import Lidar, scan
from idem_ros.simulation.street import street

STOPS = 8
CONFIG = RegistrationConfig(voxel_size=0.5)


def edges_of(clouds, odometry):
    """Return a `PosePrior` of each scan and the two after it, where their result is usable."""
    edges = []
    pairs = {(i, min(i + step, STOPS - 1)) for i in range(STOPS - 1) for step in (1, 2)}
    for i, j in sorted(pairs):
        guess = inverse(odometry[i]) @ odometry[j]
        result = register(clouds[i], clouds[j], guess, CONFIG)
        said = result.assessment
        print(f'{i}-{j}: {said.verdict.value}, overlap {result.overlap:.2f}')
        if result.is_usable:
            T, covariance = result.T_target_source, said.covariance
            edges.append(PosePrior(source=j, T=T, covariance=covariance, target=i))
    return edges


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
    graph = solve_graph(odometry, edges_of(clouds, odometry)).poses
    for name, poses in {'odometry': odometry, 'graph': graph}.items():
        off = [np.linalg.norm(T[:3, 3] - P[:3, 3]) for T, P in zip(truth, poses, strict=True)]
        print(
            f'{name}: off by {1e3 * np.mean(off):.1f} mm in the mean, {1e3 * max(off):.1f} at most'
        )


if __name__ == '__main__':
    main()
