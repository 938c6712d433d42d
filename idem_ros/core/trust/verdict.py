"""What can be said of a pose: a verdict with its probability and reason, and a covariance.

How likely a pose is right, given how the clouds agree there, is a logistic model of four numbers:
`python -m benchmarks verdict` makes its training set, fits it again and compares.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Floats, Matrix6

LEAST_PROBABILITY = 0.5  # from which on a pose is taken to be right
NOTHING_KNOWN = 1e6  # variance, in the clouds' unit squared and rad^2
LEAST_WAY = 1.0  # of the first stage's radius: the rim of its basin, about
# Of the logarithm of the way, not fitted but set: beyond the basin a result is one of several, and
# how many minima are no farther from the guess grows with the cube of the way.
BEYOND = -3.0
# of the discord nearby, the contrast, the overlap, the logarithm of the way; the constant
WEIGHTS = (-4.27, 7.32, 9.36, BEYOND, -3.13)


class Verdict(Enum):
    """What is to be thought of a pose."""

    ALIGNED = 'aligned'
    MISALIGNED = 'misaligned'
    LOW_OVERLAP = 'low_overlap'
    SEPARATED = 'separated'
    DEGENERATE = 'degenerate'
    OUTSIDE_BASIN = 'outside_basin'
    NOT_CONVERGED = 'not_converged'


@dataclass(frozen=True, eq=False)
class Assessment:
    """A verdict on a pose, and what it stands on."""

    verdict: Verdict
    p_aligned: float  # probability that it is right along every observable motion; nan: unknown
    reason: str
    free: str = ''  # the motions that nothing holds, in words, in the source's axes
    # (6, 6), x y z rx ry rz: of the source frame's pose in the target frame, about its own origin
    covariance: Matrix6 = field(default_factory=lambda: NOTHING_KNOWN * np.eye(6))
    # 90th percentile of q_i over the points that have a neighbour in the other cloud [nat]
    discord: float = np.nan
    near_discord: float = np.nan  # that of the third of them that is nearest to the sensor
    # least rise of q_mean a radius away along a motion, of the points that hold it [nat]
    contrast: float = np.nan
    # how far the next step would move the surfaces, over the radius; of an audited pose, how far
    # they are off the minimum beside it, which the other numbers are of
    step: float = 0.0
    # (6,), x y z rx ry rz: of an audited pose from the minimum beside it, along motions that are
    # held, in the target's axes about the source frame's own origin; None: no audit
    offset: Floats | None = None
    way: float = np.nan  # how far the surfaces moved from the guess, over the first radius
    overlap: float = 0.0
    # where the guess was: 0 at the minimum, 1 at the rim of its basin; nan: an audit
    basin: float = np.nan
    # how far from it the registration of target to source ends, as the surfaces move, in the
    # clouds' unit; nan: not asked for
    swap_gap: float = np.nan
    # (12, 12), x y z rx ry rz of the pose and of the result's twist; None: that was not solved
    sweep_covariance: Floats | None = None

    @property
    def twist_covariance(self) -> Matrix6 | None:
        """The (6, 6) covariance of the result's twist; None: it was not solved."""
        return None if self.sweep_covariance is None else self.sweep_covariance[6:, 6:]


def features(
    near_discord: ArrayLike, contrast: ArrayLike, overlap: ArrayLike, way: ArrayLike
) -> Floats:
    """Return the model's inputs, (..., 4)."""
    return np.stack([near_discord, contrast, overlap, _beyond(way)], -1)


def _beyond(way: ArrayLike) -> Floats:
    return np.log(np.maximum(way, LEAST_WAY))


def probability(
    near_discord: ArrayLike,
    contrast: ArrayLike,
    overlap: ArrayLike,
    way: ArrayLike,
    weights: Sequence[float] = WEIGHTS,
) -> Floats:
    """Return the probability that a pose is aligned, 0 to 1.

    Args:
        near_discord: 90th percentile of q_i over the third of the points that meet that is nearest
            to the sensor [nat]: farther off it may be the sensor's noise.
        contrast: least rise of q_mean a radius away along a motion, of what holds it [nat].
        overlap: share of the points that meet the other cloud, of that cloud of which more do.
        way: how far the surfaces moved from the guess, over the first stage's radius.
        weights: (5,).
    """
    *slopes, constant = weights
    inputs = near_discord, contrast, overlap, _beyond(way)
    logit = constant + sum(w * np.asarray(x) for w, x in zip(slopes, inputs, strict=True))
    return 1.0 / (1.0 + np.exp(-logit))
