"""How likely a pose is right, given how the clouds agree there: a logistic model of six numbers.

`python -m benchmarks verdict` makes its training set, fits it again and compares.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Floats

LEAST = 1e-3  # of the step
LEAST_SPREAD = 0.02  # below it scans differ by their noise
LEAST_WAY = 2.5  # what the basin of a first stage spans, nearly
# Of the logarithm of the way, not fitted but set: beyond the basin a result is one of several.
BEYOND = -3.0
# of discord, contrast, log10 of the step, log10 of the spread, overlap, log of the way; constant
WEIGHTS = (-3.328, 9.365, -3.425, -4.182, 3.481, BEYOND, -10.10)


def features(
    discord: ArrayLike,
    contrast: ArrayLike,
    step: ArrayLike,
    spread: ArrayLike,
    overlap: ArrayLike,
    way: ArrayLike,
) -> Floats:
    """Return the model's inputs, (..., 6)."""
    logarithms = (
        np.log10(np.asarray(step) + LEAST),
        np.log10(np.maximum(spread, LEAST_SPREAD)),
        np.log(np.maximum(way, LEAST_WAY)),
    )
    return np.stack([discord, contrast, *logarithms[:2], overlap, logarithms[2]], -1)


def probability(
    discord: ArrayLike,
    contrast: ArrayLike,
    step: ArrayLike,
    spread: ArrayLike,
    overlap: ArrayLike,
    way: ArrayLike,
    weights: Sequence[float] = WEIGHTS,
) -> Floats:
    """Return the probability that a pose is aligned, 0 to 1.

    Args:
        discord: 90th percentile of q_i over the points that meet [nat].
        contrast: least rise of q_mean a radius away along a motion, of what holds it [nat].
        step: how far the next step of the solver would move the surfaces, over the radius.
        spread: standard deviation of where regions put the loosest motion held, over the radius.
        overlap: share of the points that meet the other cloud, of that cloud of which more do.
        way: how far the surfaces moved from the guess, over the first stage's radius.
        weights: (7,).
    """
    *slopes, constant = weights
    inputs = features(discord, contrast, step, spread, overlap, way)
    return 1.0 / (1.0 + np.exp(-(inputs @ np.array(slopes) + constant)))
