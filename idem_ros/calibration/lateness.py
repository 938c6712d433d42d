"""What an error of the rig's motion does to the places of its sensors."""

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from idem_ros.core.geometry import se3

POINTS = 3000  # of a cloud, that are looked at
REACH = 3.0  # times how far points of a cloud are apart: what is nearer is seen by both
AROUND = 8  # points that tell how a surface lies


class Seen(NamedTuple):
    """Some points of a sensor."""

    tree: KDTree
    """In the frame of the reference, about."""
    times: NDArray
    normals: NDArray
    reach: float
    """[m] within which a point of another sensor is of the same surface."""


def motion_covariances(measured, poses, covariance):
    """Return the covariance (S, 6, 6) of the sensors' poses by that of the motion.

    What two sensors both see they see at different times. Where the motion is wrong by a twist,
    clouds put to one time are off by it times that difference, and the poses take up what they
    can: the least squares of all points that two see, across their surfaces.

    Args:
        measured: `Measured` of each sensor, the reference's first; None: it was silent.
        poses: (S, 4, 4) in the frame of the reference.
        covariance: (6, 6) of the twist x y z rx ry rz of the reference, in its own axes.

    Returns:
        of x y z rx ry rz of each sensor, in the axes of the reference; zero of the reference.
    """
    found = np.zeros((len(measured), 6, 6))
    if not covariance.any():
        return found
    for s, (J, pose) in enumerate(zip(_moved_by(measured, poses), poses, strict=True)):
        about = np.eye(6)
        about[:3, 3:] = -se3.skew(pose[:3, 3])
        found[s] = about @ J @ covariance @ J.T @ about.T
    return found


def _moved_by(measured, poses):
    """Return (S, 6, 6): the twist that moves each sensor, by that of the motion in a second."""
    seen = {
        s: _seen(each, pose)
        for s, (each, pose) in enumerate(zip(measured, poses, strict=True))
        if each and len(each.points) > AROUND
    }
    count = len(measured)
    holds, pulls = np.zeros((count, 6, count, 6)), np.zeros((count, 6, 6))
    for i, j in itertools.combinations(seen, 2):
        rows, later = _shared(seen[i], seen[j])
        block, pull = rows.T @ rows, rows.T @ (later[:, None] * rows)
        holds[i, :, i] += block
        holds[j, :, j] += block
        holds[i, :, j] -= block
        holds[j, :, i] -= block
        pulls[j] -= pull
        pulls[i] += pull
    of_others = 6 * (count - 1)
    matrix = holds[1:, :, 1:].reshape(of_others, of_others)
    moved = np.linalg.lstsq(matrix, pulls[1:].reshape(of_others, 6), rcond=1e-9)[0]
    return np.concatenate([np.zeros((1, 6, 6)), moved.reshape(-1, 6, 6)])


def _seen(measured, pose):
    step = max(len(measured.points) // POINTS, 1)
    points = se3.transform_points(pose, measured.points[::step])
    times = np.zeros(len(points)) if measured.times is None else measured.times[::step]
    tree = KDTree(points)
    distances, near = tree.query(points, AROUND)
    around = points[near] - points[near].mean(axis=1, keepdims=True)
    normals = np.linalg.eigh(np.einsum('nki,nkj->nij', around, around))[1][:, :, 0]
    return Seen(tree, times, normals, REACH * float(np.median(distances[:, 1])))


def _shared(first, second):
    """Return n . [-[p]x, I]'s rows (N, 6) of points that both see, and how much later the second.

    A row times a twist x y z rx ry rz is how far that moves the point across its surface.
    """
    points = second.tree.data
    distances, nearest = first.tree.query(points, distance_upper_bound=first.reach)
    both = np.isfinite(distances)
    nearest, points = nearest[both], points[both]
    normals = first.normals[nearest]
    rows = np.hstack([normals, np.cross(points, normals)])
    return rows, second.times[both] - first.times[nearest]
