"""How much of a ratio between two methods' errors is chance: both had the same few cases."""

import numpy as np
from scipy.stats import binomtest, bootstrap

RESAMPLINGS = 2000
WITHIN = 0.95  # of them


def ratio_interval(ours, theirs, percent):
    """Return (low, high) of the ratio of two percentiles, over paired resamplings of the cases.

    Args:
        ours: (N,) errors of one method, a case each.
        theirs: (N,) errors of another in the same cases.
        percent: which percentile, 0 to 100.

    Returns:
        What holds 95 % of the ratios (percentile bootstrap, Efron 1979); the same in every run.
        None: an error is None or not finite, or there are too few to resample.
    """
    errors = np.array([ours, theirs], float)
    if not np.isfinite(errors).all() or errors.shape[1] < 2:
        return None

    def ratio(upper, lower, axis=-1):
        return np.percentile(upper, percent, axis) / np.percentile(lower, percent, axis)

    interval = bootstrap(
        errors,
        ratio,
        paired=True,
        method='percentile',
        n_resamples=RESAMPLINGS,
        confidence_level=WITHIN,
        random_state=0,
    ).confidence_interval
    return float(interval.low), float(interval.high)


def sign_test(ours, theirs):
    """Return how likely it is by chance that two methods' right results differ as much, or more.

    Args:
        ours: (N,) bool, whether one method was right, a case each.
        theirs: (N,) bool, of another in the same cases.

    Returns:
        p of the exact two-sided sign test over the cases that one of them alone got right
        (McNemar 1947); 1 where there are none.
    """
    ours, theirs = np.array(ours, bool), np.array(theirs, bool)
    alone = int(np.sum(ours & ~theirs)), int(np.sum(theirs & ~ours))
    return float(binomtest(alone[0], sum(alone)).pvalue) if any(alone) else 1.0
