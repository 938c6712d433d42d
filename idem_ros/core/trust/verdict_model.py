"""How likely a pose is right, given how the clouds agree there: a logistic model of three numbers.

`python -m benchmarks verdict` makes its training set, fits it again and compares.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Floats

LEAST = 1e-3  # of the step
WEIGHTS = (-11.17, 5.553, -3.755, -4.082)  # of discord, contrast, log10 of the step; the constant


def features(discord: ArrayLike, contrast: ArrayLike, step: ArrayLike) -> Floats:
    """Return the model's inputs, (..., 3)."""
    return np.stack([discord, contrast, np.log10(np.asarray(step) + LEAST)], -1)


def probability(
    discord: ArrayLike, contrast: ArrayLike, step: ArrayLike, weights: Sequence[float] = WEIGHTS
) -> Floats:
    """Return the probability that a pose is aligned, 0 to 1.

    Args:
        discord: 90th percentile of q_i over the points that meet [nat].
        contrast: least rise of q_mean a radius away along a motion, of what holds it [nat].
        step: how far the next step of the solver would move the surfaces, over the radius.
        weights: (4,).
    """
    *slopes, constant = weights
    return 1.0 / (1.0 + np.exp(-(features(discord, contrast, step) @ np.array(slopes) + constant)))
