"""What the noise of points alone leaves open, for whoever knows all but the surface and the poses.

The Cramér-Rao bound: at each place n_b points of scan b tell of where its surface is along its
normal, each with the sensor's noise. Where the surface itself is nobody knows, so that scans tell
of one another alone: with J = [x × n, n] the information is sum_places (delta_bb' n_b
- n_b n_b' / N) J^T J / noise^2. No unbiased method can have smaller errors.
"""

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.several.scenes import NOISE
from idem_ros.core.geometry import se3

PLACE = 0.002  # [m], edge of the cubes within which a surface is flat
NEIGHBOURS = 24  # of a point, that tell its normal
DRAWS = 30  # of poses, by the bound's covariance


def drawn_poses(scene, rng):
    """Return (`DRAWS`, K, 4, 4) poses that are off the truth as the bound's covariance has it."""
    placed = [se3.transform_points(T, c) for T, c in zip(scene.truth, scene.clouds, strict=True)]
    variances, axes = np.linalg.eigh(_information(placed) / NOISE**2)
    kept = variances > 1e-9 * variances.max()  # all but a common motion
    root = axes[:, kept] / np.sqrt(variances[kept])
    twists = rng.normal(size=(DRAWS, root.shape[1])) @ root.T
    return [
        np.array([se3.exp(v) @ T for v, T in zip(each.reshape(-1, 6), scene.truth, strict=True)])
        for each in twists
    ]


def _information(placed):
    """Return the (6 K, 6 K) information of unit noise, by twists on the left of each pose."""
    points, count = np.concatenate(placed), len(placed)
    cloud = np.repeat(np.arange(count), [len(each) for each in placed])
    cubes = np.floor(points / PLACE).astype(np.int64)
    _, first, place = np.unique(cubes, axis=0, return_index=True, return_inverse=True)
    number = np.zeros((len(first), count))
    np.add.at(number, (place.ravel(), cloud), 1.0)
    of_place = _normals(points, first)
    J = np.c_[np.cross(points[first], of_place), of_place]
    information, total = np.zeros((count, 6, count, 6)), number.sum(axis=1)
    for a in range(count):
        for b in range(count):
            weight = (a == b) * number[:, a] - number[:, a] * number[:, b] / total
            information[a, :, b] = (J * weight[:, None]).T @ J
    return information.reshape(6 * count, 6 * count)


def _normals(points, some):
    near = points[cKDTree(points).query(points[some], NEIGHBOURS)[1]]
    near -= near.mean(axis=1, keepdims=True)
    return np.linalg.eigh(np.einsum('nki,nkj->nij', near, near))[1][:, :, 0]
