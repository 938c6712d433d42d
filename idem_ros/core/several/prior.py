"""What is known of poses before any point is looked at, with its covariance."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Matrix6, Transform
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.geometry import se3

SYMMETRY = 1e-6  # of the greatest entry


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
