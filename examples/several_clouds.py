"""Ten scans around an object, registered at once: poses that close, and how well the scans agree.

Beside them the same scans registered one to the next, whose errors add up around the ring.

Run it as `python examples/several_clouds.py`, or with a name for a picture of before and after.
"""

import argparse

import numpy as np
from scipy.spatial.transform import Rotation

from idem_ros.core import Cloud, RegistrationConfig, register, register_all
from idem_ros.core.geometry.se3 import inverse, rotation_angle, transform_points
from idem_ros.simulation.body import random_body, surface_points

SCANS, POINTS, NOISE = 10, 6000, 0.0002  # [m]
SEEN = np.radians(80)  # to either side of where a scan looks from
CONFIG = RegistrationConfig(voxel_size=0.002)


def ring(rng):
    """Return clouds around a body, each in a frame of its own, and these frames' poses."""
    body, clouds, poses = random_body(rng), [], []
    for k in range(SCANS):
        points = surface_points(rng, POINTS, body)
        azimuth = np.arctan2(points[:, 1], points[:, 0]) - 2 * np.pi * k / SCANS
        points = points[np.cos(azimuth) > np.cos(SEEN)]
        points += rng.normal(0.0, NOISE, points.shape)
        pose = off(np.eye(4), 60.0, 0.1, rng) if k else np.eye(4)
        poses.append(pose)
        clouds.append(transform_points(inverse(pose), points))
    return clouds, np.array(poses)


def off(T, degrees, distance, rng):
    """Return a pose that is off by so much, in a random direction."""
    axis, direction = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    moved = T.copy()
    moved[:3, :3] = Rotation.from_rotvec(np.radians(degrees) * axis).as_matrix() @ T[:3, :3]
    moved[:3, 3] += distance * direction
    return moved


def chain(clouds, starts):
    """Return the poses of scans that are registered one to the next, and once around."""
    poses = [starts[0]]
    for k in range(SCANS):
        i, j = k, (k + 1) % SCANS
        guess = inverse(starts[i]) @ starts[j]
        result = register(Cloud(clouds[i]), Cloud(clouds[j]), guess, CONFIG)
        poses.append(poses[-1] @ result.T_target_source)
    return poses


def main():
    """Print the overlap graph, and how far both ways end from the truth."""
    parser = argparse.ArgumentParser(description='Register ten scans at once.')
    parser.add_argument('picture', nargs='?', help='.png of before and after to write')
    picture = parser.parse_args().picture
    rng = np.random.default_rng(4)
    clouds, truth = ring(rng)
    starts = np.array([T if k == 0 else off(T, 2.0, 0.002, rng) for k, T in enumerate(truth)])
    result = register_all(clouds, starts, CONFIG)
    for edge in result.edges:
        print(f'{edge.i}-{edge.j}: overlap {edge.overlap:.2f}, {edge.verdict.value}')
    one_by_one = chain(clouds, starts)
    gap = np.degrees(rotation_angle(inverse(one_by_one[0]) @ one_by_one[-1]))
    print(f'one to the next: open by {gap:.3f} deg; at once: closed')
    for name, poses in (('one to the next', one_by_one[:-1]), ('at once', result.poses)):
        errors = [rotation_angle(inverse(a) @ b) for a, b in zip(truth, poses, strict=True)]
        print(f'{name}: off by {np.degrees(np.mean(errors[1:])):.4f} deg in the mean')
    sigmas = np.sqrt(np.diag(result.covariance)[6:].reshape(-1, 6)[:, 3:])
    print(f'standard deviations promised: {np.degrees(sigmas.mean()):.4f} deg an axis')
    if picture:
        from idem_ros.report.clouds_picture import draw_clouds

        draw_clouds(picture, clouds, starts, result.poses)


if __name__ == '__main__':
    main()
