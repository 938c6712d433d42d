"""q_tot of one pair of clouds at many transforms, and poses around a pose, where to look at it.

The clouds are sorted and taken alone once. Poses are along an axis, in a plane, in a volume.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from idem_ros.core.arrays import Floats, Integers, Point, Transform, Transforms
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import InvalidConfig, InvalidTransform
from idem_ros.core.geometry import se3
from idem_ros.core.metric.balls import between_origins
from idem_ros.core.metric.cloud import CloudLike, as_cloud, neighbourhoods
from idem_ros.core.metric.entropy import differences_at_each, length_unit, sums_of_each
from idem_ros.core.metric.measured_points import usual
from idem_ros.core.metric.q_tot import checked_positive, search_radius
from idem_ros.core.workers import Workers, in_threads

SPAN = 16  # transforms that a thread takes at a time
ROUNDED = 1e-12  # how far a rotation may be off before it is made orthonormal
AXES = ('x', 'y', 'z', 'rx', 'ry', 'rz')  # along [length] and around [rad] the target frame's


class Values(NamedTuple):
    """What `Landscape.values` found at each of K transforms."""

    q_tot: Floats  # (K,) [nat]
    within: Integers  # (K,): points of both clouds with a neighbour in the other


class Landscape:
    """q_tot (Eq. 8) of one pair as a function of the transform between them.

    The same numbers as `q_tot`, to rounding. Whatever the number of threads, each transform is
    summed by one of them: the results are the same, to the bit.

    Args:
        target: (N, 3) points or a `Cloud`, in the target frame.
        source: (M, 3) points or a `Cloud`, in the source frame.
        radius: of the neighbourhoods, in the clouds' unit; None: Eq. 9 with a = 1.
        length_scale: 'radius' or 'none', as for `q_tot`.
        threads: that share the transforms of one call.

    Raises:
        InvalidCloud, InvalidConfig: for what cannot be evaluated.
    """

    def __init__(
        self,
        target: CloudLike,
        source: CloudLike,
        radius: float | None = None,
        length_scale: str = 'radius',
        threads: int = 1,
    ) -> None:
        RegistrationConfig(length_scale=length_scale, threads=threads)  # refuses what is neither
        self.target, self.source = as_cloud(target), as_cloud(source)
        self._workers = Workers(threads)
        if radius is None:
            self.radius = search_radius(self.target, self.source)
        else:
            self.radius = checked_positive('radius', radius)
        self._scale = length_unit(length_scale, self.radius)
        if self.radius > 0.0:
            self._own = neighbourhoods((self.target, self.source), self.radius, self._workers)

    def at(self, transforms: ArrayLike) -> Floats:
        """Return q_tot, (K,) [nat], at T_target_source of (K, 4, 4).

        Raises:
            InvalidTransform: another shape, or one that is not a rigid motion, by its number.
        """
        return self.values(transforms).q_tot

    def values(self, transforms: ArrayLike) -> Values:
        """Return `Values`: q_tot and the points with a neighbour across, as for `at`."""
        transforms = between_origins(self.target, self.source, _checked(transforms))
        if self.radius == 0.0 or not len(transforms):  # one place: every entropy is 0
            return Values(np.zeros(len(transforms)), np.zeros(len(transforms), np.int64))
        parts = [transforms[begin : begin + SPAN] for begin in range(0, len(transforms), SPAN)]
        found = in_threads(self._workers, self._of_span, parts)
        q, within = zip(*found, strict=True)
        return Values(np.concatenate(q), np.concatenate(within))

    def _of_span(self, transforms: Transforms) -> tuple[Floats, Integers]:
        """Return the same, (K,) each, of a few transforms between the clouds' origins."""
        target, source = self._own
        q, within = np.zeros(len(transforms)), np.zeros(len(transforms), np.int64)
        for centres, others, at in (
            (target, source, transforms),
            (source, target, se3.inverses(transforms)),
        ):
            each = differences_at_each(centres, others, at, self.radius, self._scale)
            total, count = sums_of_each(*each, np.ones(len(each[0]), np.bool_))
            q += total
            within += count
        return q, within


def _checked(transforms: ArrayLike) -> Transforms:
    """Return (K, 4, 4) float64; only those that are not rigid to the last digits cost time."""
    try:
        T = np.array(transforms, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidTransform(f'transforms are not matrices of numbers: {error}') from error
    if T.ndim != 3 or T.shape[1:] != (4, 4):
        raise InvalidTransform(f'transforms have shape {T.shape}; they must be (K, 4, 4)')
    R = T[:, :3, :3]
    with np.errstate(invalid='ignore', over='ignore'):
        error = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
        rigid = (error <= ROUNDED) & (np.linalg.det(R) > 0) & (T[:, 3] == (0, 0, 0, 1)).all(1)
    rigid &= np.isfinite(T).all(axis=(1, 2))
    for k in np.flatnonzero(~rigid):
        T[k] = se3.checked_transform(T[k], f'transforms[{k}]')
    return T


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
