"""Poses around a pose: along an axis, in a plane, in a volume; and q_tot at all of them."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from idem_ros.core.arrays import Floats, Point, Transform, Transforms
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.geometry import se3
from idem_ros.core.metric.landscape import Landscape
from idem_ros.core.metric.measured_points import usual

AXES = ('x', 'y', 'z', 'rx', 'ry', 'rz')  # along [length] and around [rad] the target frame's


def displaced(T_target_source: Transform, offsets: ArrayLike, pivot: Point) -> Transforms:
    """Return (K, 4, 4): a pose followed by each of K displacements of the source.

    Args:
        T_target_source: (4, 4) rigid transform.
        offsets: (K, 6) along x, y, z [length] and around them [rad], axes of the target frame;
            the source turns around x first, then y, then z, and is shifted last.
        pivot: (3,) point of the target frame that the rotations leave alone.
    """
    offsets = np.asarray(offsets, dtype=np.float64)
    result = np.tile(np.eye(4), (len(offsets), 1, 1))
    R = Rotation.from_euler('xyz', offsets[:, 3:]).as_matrix()
    result[:, :3, :3] = R @ T_target_source[:3, :3]
    result[:, :3, 3] = R @ (T_target_source[:3, 3] - pivot) + pivot + offsets[:, :3]
    return result


def offsets_on_grid(**coordinates: ArrayLike) -> tuple[tuple[int, ...], Floats]:
    """Return the shape of a grid and its offsets (K, 6), the first axis named varying slowest.

    Args:
        coordinates: offsets along each axis of the grid, 1-D, by its name in `AXES`.
    """
    unknown = [name for name in coordinates if name not in AXES]
    if unknown or not coordinates:
        raise InvalidConfig(f'axes of a grid are {AXES}; given: {unknown or "none"}')
    mesh = np.meshgrid(*coordinates.values(), indexing='ij')
    offsets = np.zeros((mesh[0].size, len(AXES)))
    for name, values in zip(coordinates, mesh, strict=True):
        offsets[:, AXES.index(name)] = values.ravel()
    return mesh[0].shape, offsets


def centroid(landscape: Landscape, T_target_source: Transform) -> Point:
    """Return the mean (3,) of the source's points, moved into the target frame."""
    mean = usual(landscape.source.points).mean(axis=0) + landscape.source.origin
    return se3.transform_points(T_target_source, mean)


def q_on_grid(
    landscape: Landscape,
    T_target_source: ArrayLike | None = None,
    pivot: ArrayLike | None = None,
    **coordinates: ArrayLike,
) -> Floats:
    """Return q_tot at displacements of the source around a pose, one array axis per grid axis.

    Args:
        landscape: the `Landscape` of the two clouds.
        T_target_source: (4, 4) the pose at offset 0; None: identity.
        pivot: (3,) of the rotations, in the target frame; None: the source's centroid, moved.
        coordinates: as for `offsets_on_grid`, e.g. x=np.linspace(-5, 5, 41), y=[0.0].

    Raises:
        InvalidTransform, InvalidConfig: no rigid pose; an axis that is not in `AXES`.
    """
    T = np.eye(4) if T_target_source is None else se3.checked_transform(T_target_source)
    shape, offsets = offsets_on_grid(**coordinates)
    pivot = centroid(landscape, T) if pivot is None else np.asarray(pivot, dtype=np.float64)
    return landscape.at(displaced(T, offsets, pivot)).reshape(shape)
