"""How much of a ratio between two methods' errors is chance: both had the same few cases."""

import numpy as np

RESAMPLINGS = 2000
WITHIN = 95.0  # percent of them


def ratio_interval(ours, theirs, percent):
    """Return (low, high) of the ratio of two percentiles, over paired resamplings of the cases.

    Args:
        ours: (N,) errors of one method, a case each.
        theirs: (N,) errors of another in the same cases.
        percent: which percentile, 0 to 100.

    Returns:
        What holds 95 % of the ratios (percentile bootstrap, Efron 1979); the same in every run.
        None: an error is None or not finite.
    """
    errors = np.array([ours, theirs], float)
    if not np.isfinite(errors).all():
        return None
    picks = np.random.default_rng(0).integers(len(ours), size=(RESAMPLINGS, len(ours)))
    upper, lower = np.percentile(errors[:, picks], percent, axis=-1)
    tail = 0.5 * (100.0 - WITHIN)
    low, high = np.percentile(upper / lower, (tail, 100.0 - tail))
    return float(low), float(high)
