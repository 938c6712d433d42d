"""q_tot of one pair of clouds at many transforms: the clouds are sorted and taken alone once."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Floats, Integers, Transforms
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import InvalidTransform
from idem_ros.core.geometry import se3
from idem_ros.core.metric.balls import between_origins
from idem_ros.core.metric.cloud import CloudLike, as_cloud, neighbourhoods
from idem_ros.core.metric.entropy import differences_at_each, length_unit, sums_of_each
from idem_ros.core.metric.q_tot import checked_positive, search_radius
from idem_ros.core.workers import Workers, in_threads

SPAN = 16  # transforms that a thread takes at a time
ROUNDED = 1e-12  # how far a rotation may be off before it is made orthonormal


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
