"""What is asked of a joint registration, and known of poses before any point is looked at.

It is checked, and put into an order that no numbering changes.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Mask, Matrix6, Point, Points, Transform, Transforms
from idem_ros.core.exceptions import InvalidCloud, InvalidConfig, InvalidTransform
from idem_ros.core.geometry import se3
from idem_ros.core.metric.cloud import Cloud, CloudLike, as_cloud
from idem_ros.core.workers import Workers, in_threads

SYMMETRY = 1e-6  # of the greatest entry
SAMPLE = 64  # points, about, that tell one cloud from another


@dataclass(frozen=True, eq=False)
class PosePrior:
    """A pose that is known as well as its covariance says.

    Attributes:
        source: number of the cloud whose pose it is.
        T: (4, 4) that pose, in the frame of the target.
        covariance: (6, 6), x y z rx ry rz: of the source frame's pose in the target's axes, about
            the source frame's own origin, in the clouds' unit and rad.
        target: number of the cloud in whose frame it is; None: in the common frame.

    Raises:
        InvalidConfig: a covariance that is none; InvalidTransform: T is no rigid transform.
    """

    source: int
    T: ArrayLike
    covariance: ArrayLike
    target: int | None = None
    transform: Transform = field(init=False, repr=False)
    information: Matrix6 = field(init=False, repr=False)  # by twists (omega, v)

    def __post_init__(self) -> None:
        name = f'the prior of cloud {self.source}'
        object.__setattr__(self, 'transform', se3.checked_transform(self.T, name))
        object.__setattr__(self, 'information', _information(self.covariance, name))


def checked_priors(priors: 'list[PosePrior] | tuple[PosePrior, ...]', count: int) -> None:
    """Refuse priors of clouds that there are not.

    Raises:
        InvalidConfig: it says which.
    """
    for prior in priors:
        if not isinstance(prior, PosePrior):
            raise InvalidConfig(f'priors holds {prior!r}; it must hold PosePriors')
        named = (prior.source,) if prior.target is None else (prior.source, prior.target)
        for number in named:
            if not 0 <= number < count:
                raise InvalidConfig(
                    f'a prior names cloud {number}; there are {count}, from 0 to {count - 1}'
                )
        if prior.source == prior.target:
            raise InvalidConfig(f'a prior has cloud {prior.source} as source and as target')


def _information(covariance: ArrayLike, name: str) -> Matrix6:
    try:
        matrix = np.array(covariance, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidConfig(f'the covariance of {name} is no matrix: {error}') from error
    if matrix.shape != (6, 6):
        raise InvalidConfig(
            f'the covariance of {name} has shape {matrix.shape}; it must be (6, 6)'
        )
    most = np.abs(matrix).max()
    asymmetric = not np.isfinite(matrix).all() or np.abs(matrix - matrix.T).max() > SYMMETRY * most
    if asymmetric or np.linalg.eigvalsh(matrix)[0] <= 0.0:
        raise InvalidConfig(
            f'the covariance of {name} is not symmetric with variances above 0 in every direction'
        )
    information = np.linalg.inv(matrix).astype(np.float64)
    return information[np.ix_(se3.ROS_ORDER, se3.ROS_ORDER)]


class Problem(NamedTuple):
    """Clouds, where they start, and what is known besides."""

    clouds: list[Cloud]
    poses: Transforms  # (K, 4, 4): cloud frames to the common frame
    held: tuple[int, ...]
    priors: tuple[PosePrior, ...]

    @property
    def is_a_pair(self) -> bool:
        """Whether it is what `register` solves."""
        return len(self.clouds) == 2 and len(self.held) == 1 and not self.priors

    @property
    def origins(self) -> Points:
        """The clouds' origins in their own frames, (K, 3)."""
        return np.array([cloud.origin for cloud in self.clouds])

    def middles(self) -> Points:
        """Return where the clouds' origins are in the common frame, (K, 3)."""
        R, t = self.poses[:, :3, :3], self.poses[:, :3, 3]
        return np.einsum('kij,kj->ki', R, self.origins) + t

    def of(self, numbers: Sequence[int]) -> 'Problem':
        """Return the problem of some of the clouds, renumbered in this order."""
        place = {int(old): new for new, old in enumerate(numbers)}
        priors = [
            replace(
                prior,
                source=place[prior.source],
                target=None if prior.target is None else place[prior.target],
            )
            for prior in self.priors
            if prior.source in place and (prior.target is None or prior.target in place)
        ]
        return Problem(
            [self.clouds[k] for k in numbers],
            self.poses[list(numbers)],
            tuple(place[k] for k in self.held if k in place),
            tuple(priors),
        )


def checked_problem(
    clouds: Sequence[CloudLike],
    poses: ArrayLike | None,
    held: Iterable[int] | None,
    priors: Iterable[PosePrior],
    workers: Workers,
) -> Problem:
    """Return the `Problem`, or refuse what is none; see `register_all`."""
    given = _listed(clouds)
    count = len(given)
    all_priors = tuple(priors)
    checked_priors(all_priors, count)
    if held is None:
        is_anchored = any(prior.target is None for prior in all_priors)
        numbers = () if is_anchored else (0,)
    else:
        numbers = _checked_held(held, count)
    numbered = list(zip(range(count), given, strict=True))
    made = in_threads(workers, _made, numbered)
    return Problem(made, _checked_poses(poses, count), numbers, all_priors)


def in_common_order(problem: Problem) -> list[int]:
    """Return the clouds' numbers in an order that depends on the clouds, not on their numbers."""

    def key(k: int) -> tuple[int, bytes, bytes]:
        """Return what tells one from another."""
        points = problem.clouds[k].points
        sample = points[:: max(len(points) // SAMPLE, 1)]
        return len(points), sample.tobytes(), problem.poses[k].tobytes()

    return sorted(range(len(problem.clouds)), key=key)


def between_middles(problem: Problem, offset: Point) -> Transforms:
    """Return poses (K, 4, 4) of the frames at the clouds' origins, moved by minus an offset."""
    poses = problem.poses.copy()
    poses[:, :3, 3] = problem.middles() - offset
    return poses


def shifted(priors: Sequence[PosePrior], offset: Point) -> tuple[PosePrior, ...]:
    """Return priors, the absolute ones moved by minus an offset."""
    back = se3.translation(-offset)
    return tuple(
        prior if prior.target is not None else replace(prior, T=back @ prior.transform)
        for prior in priors
    )


def held_mask(numbers: Iterable[int], count: int) -> Mask:
    """Return which of the clouds are held, (K,)."""
    mask = np.zeros(count, np.bool_)
    mask[list(numbers)] = True
    return mask


def _listed(clouds: Any) -> list[CloudLike]:
    is_array = isinstance(clouds, np.ndarray) and cast(Any, clouds).ndim == 2
    if is_array or isinstance(clouds, (Cloud, str)):
        raise InvalidCloud('one cloud was given in place of several: give a list of clouds')
    try:
        given: list[CloudLike] = list(cast(Any, clouds))
    except TypeError as error:
        raise InvalidCloud(f'clouds is {clouds!r}; it must be a list of clouds') from error
    if len(given) < 2:
        raise InvalidCloud(f'{len(given)} cloud was given; two at least are registered')
    return given


def _made(numbered: tuple[int, CloudLike]) -> Cloud:
    number, cloud = numbered
    try:
        return as_cloud(cloud)
    except InvalidCloud as error:
        raise InvalidCloud(f'cloud {number}: {error}') from error


def _checked_poses(poses: ArrayLike | None, count: int) -> Transforms:
    if poses is None:
        return np.tile(np.eye(4), (count, 1, 1))
    try:
        given: list[Any] = list(cast(Any, poses))
    except TypeError as error:
        raise InvalidTransform(f'poses is {poses!r}; it must be (K, 4, 4)') from error
    if len(given) != count:
        raise InvalidTransform(
            f'{len(given)} poses were given for {count} clouds: there must be one for each'
        )
    return np.array(
        [se3.checked_transform(T, f'the pose of cloud {k}') for k, T in enumerate(given)]
    )


def _checked_held(held: Iterable[int], count: int) -> tuple[int, ...]:
    try:
        numbers = sorted({int(number) for number in held})
    except (TypeError, ValueError) as error:
        raise InvalidConfig(f'held is {held!r}; it must hold numbers of clouds') from error
    for number in numbers:
        if not 0 <= number < count:
            raise InvalidConfig(f'held names cloud {number}; there are {count}, from 0 on')
    return tuple(numbers)
