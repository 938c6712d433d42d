"""How likely a pose is right, given how its surroundings look: a logistic model of two numbers.

`idem experiments run verdict` makes its training set, fits it again and compares.
"""

import numpy as np

LEAST = 1e-3  # of either number
WEIGHTS = (2.331, -2.760, -4.088)  # of the logarithms of contrast and step, and the constant


def features(contrast, step):
    """Return the model's inputs, (..., 2): decimal logarithms, bounded from below."""
    return np.stack([np.log10(np.maximum(contrast, LEAST)), np.log10(step + LEAST)], -1)


def probability(contrast, step, weights=WEIGHTS):
    """Return the probability that a pose is aligned, 0 to 1.

    Args:
        contrast: least rise of q_mean a radius away along a motion, over how firmly it is held.
        step: how far the next step of the solver would move the surfaces, over the radius.
        weights: (3,).
    """
    *slopes, constant = weights
    return 1.0 / (1.0 + np.exp(-(features(contrast, step) @ np.array(slopes) + constant)))
