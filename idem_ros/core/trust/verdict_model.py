"""How likely a pose is right, given how the clouds agree there: a logistic model of four numbers.

`python -m benchmarks verdict` makes its training set, fits it again and compares.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Floats

LEAST_WAY = 1.0  # of the first stage's radius: the rim of its basin, about
# Of the logarithm of the way, not fitted but set: beyond the basin a result is one of several, and
# how many minima are no farther from the guess grows with the cube of the way.
BEYOND = -3.0
# of the discord nearby, the contrast, the overlap, the logarithm of the way; the constant
WEIGHTS = (-4.27, 7.32, 9.36, BEYOND, -3.13)


def features(
    near_discord: ArrayLike, contrast: ArrayLike, overlap: ArrayLike, way: ArrayLike
) -> Floats:
    """Return the model's inputs, (..., 4)."""
    beyond = np.log(np.maximum(way, LEAST_WAY))
    return np.stack([near_discord, contrast, overlap, beyond], -1)


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
    inputs = features(near_discord, contrast, overlap, way)
    return 1.0 / (1.0 + np.exp(-(inputs @ np.array(slopes) + constant)))
