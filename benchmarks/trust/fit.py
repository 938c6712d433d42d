"""Fit the verdict's model, and tell how good a judge is: accuracy, calibration, ROC area."""

import numpy as np
from scipy.optimize import minimize

from benchmarks.trust.poses import NUMBERS
from idem_ros.core.trust.basin import LAST
from idem_ros.core.trust.verdict import BEYOND, features, probability
from idem_ros.core.trust_tuning import TrustTuning

FAR_AND_WRONG = 4.0  # times as much: to believe such a one does harm
RIDGE = 1e-4  # on weights of standardised inputs: the classes are nearly separable
BINS = 10


def fitted(poses):
    """Return the model's weights (5,): each kind, class and way a pose was made counts alike.

    That of the way is not fitted, but `BEYOND`.

    Args:
        poses: `Judged`, none of which is neither right nor wrong; it learns from the `is_seen`.
    """
    poses = [each for each in poses if is_seen(each)]
    inputs = features(*numbers_of(poses))
    beyond, inputs = BEYOND * inputs[:, -1], inputs[:, :-1]
    right = np.array([each.right for each in poses], float)
    groups = [(each.kind, each.right, each.how) for each in poses]
    weight = np.array([1.0 / groups.count(group) for group in groups])
    weight[[not each.right and each.how == 'far' for each in poses]] *= FAR_AND_WRONG
    mean, scale = inputs.mean(axis=0), inputs.std(axis=0)
    design = np.c_[(inputs - mean) / scale, np.ones(len(inputs))]

    def loss(w):
        z, slopes = design @ w + beyond, np.r_[w[:-1], 0.0]
        surprise = np.logaddexp(0.0, np.where(right, -z, z)) @ weight / weight.sum()
        pull = design.T @ (weight * (1 / (1 + np.exp(-z)) - right)) / weight.sum()
        return surprise + RIDGE * slopes @ slopes, pull + 2 * RIDGE * slopes

    w = minimize(loss, np.zeros(design.shape[1]), jac=True).x
    slopes = w[:-1] / scale
    return np.r_[slopes, BEYOND, w[-1] - slopes @ mean]


def is_seen(pose):
    """Whether a `Judged` pose is the model's to judge: nothing is free, and enough overlaps."""
    return not pose.free and pose.overlap >= TrustTuning().least_overlap


def numbers_of(poses):
    """Return what a model judges poses by, (4, N)."""
    return np.array([[getattr(each, name) for name in NUMBERS] for each in poses]).T


def left_out(poses):
    """Return {kind: p of each pose of that kind, by a model that never saw the kind}."""
    found = {}
    for kind in dict.fromkeys(each.kind for each in poses):
        weights = fitted([each for each in poses if each.kind != kind])
        of_kind = numbers_of([each for each in poses if each.kind == kind])
        found[kind] = probability(*of_kind, weights)
    return found


def fitted_confidence(ways):
    """Return (slope, middle) of the confidence of the stage that `Way`s were foretold by."""
    success = np.array([each.success for each in ways], float)
    told = np.clip([each.confidence for each in ways], 1e-9, 1 - 1e-9)
    slope, middle = LAST  # by which it was told: back to the mean contrast
    logarithm = np.log(middle) + np.log(told / (1 - told)) / slope
    design = np.c_[logarithm, np.ones(len(told))]

    def loss(w):
        z = design @ w
        return np.logaddexp(0.0, np.where(success > 0, -z, z)).mean() + RIDGE * w[0] ** 2

    w = minimize(loss, np.zeros(2)).x
    return w[0], np.exp(-w[1] / w[0])


def calibration_error(p, right):
    """Return the expected calibration error: |mean p - share right|, over ten bins of p."""
    p, right = np.asarray(p), np.asarray(right, float)
    bins = np.minimum((p * BINS).astype(int), BINS - 1)
    gaps = [abs((p[bins == b] - right[bins == b]).sum()) for b in np.unique(bins)]
    return float(sum(gaps) / len(p))


def best_threshold(score, right):
    """Return the threshold on a score, the higher the better, that is most often right."""
    score, right = np.asarray(score), np.asarray(right, bool)
    tried = np.r_[-np.inf, np.unique(score)]
    above = right.sum() - np.searchsorted(np.sort(score[right]), tried, 'right')
    below = np.searchsorted(np.sort(score[~right]), tried, 'right')
    return float(tried[np.argmax(above + below)])


def roc_area(score, right):
    """Return the area under the ROC curve: how often a right one scores above a wrong one."""
    right = np.asarray(right, bool)
    above, below = np.asarray(score)[right], np.asarray(score)[~right]
    wins = np.searchsorted(np.sort(below), above, 'left').sum()
    ties = np.searchsorted(np.sort(below), above, 'right').sum() - wins
    return float((wins + 0.5 * ties) / (len(above) * len(below)))
