"""Scenes that leave motions free: a plane, a corridor with and without a box, a pole, a sphere."""

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.case import Case
from idem_ros.core.geometry import se3

POINTS = 4000
NOISE = 0.01  # [m]
CORRIDOR = np.array([12.0, 1.5, 1.25])  # [m], half its length, width and height
BOX, BOX_AT = 0.4, (2.0, 0.6, -0.85)  # [m], half an edge, and where its middle is
OFF = 1.0  # [m], about how far the frames are from each other


def _plane(rng, n):
    return np.c_[rng.uniform(-5, 5, (n, 2)), np.zeros(n)]


def _corridor(rng, n):
    walls = [_face(rng, n // 4, axis, side) * CORRIDOR for axis in (1, 2) for side in (-1, 1)]
    return np.concatenate(walls)


def _box_in_corridor(rng, n):
    faces = [_face(rng, n // 100, axis, side) for axis in range(3) for side in (-1, 1)]
    return np.concatenate([_corridor(rng, n), BOX * np.concatenate(faces) + BOX_AT])


def _face(rng, n, axis, side):
    points = rng.uniform(-1, 1, (n, 3))
    points[:, axis] = side
    return points


def _pole(rng, n):
    angle = rng.uniform(0, 2 * np.pi, n)
    return np.c_[0.4 * np.cos(angle), 0.4 * np.sin(angle), rng.uniform(-2, 2, n)]


def _sphere(rng, n):
    direction = rng.normal(size=(n, 3))
    return direction / np.linalg.norm(direction, axis=1, keepdims=True)


_TURNS, _MOVES = np.split(np.eye(6), 2)
BARE_SCENES = {
    'plane': (_plane, [_TURNS[2], _MOVES[0], _MOVES[1]]),
    'corridor': (_corridor, [_MOVES[0]]),
    'pole': (_pole, [_TURNS[2], _MOVES[2]]),
    'sphere': (_sphere, list(_TURNS)),
    'box in corridor': (_box_in_corridor, []),
}
"""Name: what samples it, and the twists (omega, v) in the target frame that it leaves free."""


def bare_case(name, seed, voxel_size=None, noise=NOISE):
    """Return the `Case` of two noisy samplings of a bare scene, the target's frame its own."""
    rng = np.random.default_rng([seed, *name.encode()])
    sample, _ = BARE_SCENES[name]
    target, source = (
        (points := sample(rng, POINTS)) + noise * rng.normal(size=points.shape) for _ in range(2)
    )
    truth = np.eye(4)
    truth[:3, :3] = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    truth[:3, 3] = OFF * rng.normal(size=3)
    source = se3.transform_points(se3.inverse(truth), source)
    return Case(f'{name} {seed}', target, source, truth, voxel_size)
