"""Whether the covariance holds in kinds of place that no number of it was fitted on."""

import numpy as np

from benchmarks.goal import Goal
from benchmarks.trust.spread import within

LEAST_NEES, MOST_NEES = 0.7, 1.4  # over 6
LEAST_68, MOST_68, LEAST_95 = 58.0, 78.0, 90.0  # [%], of every axis


def place_goals(spreads):
    """Return the `Goal`s of `Spread`s: per kind the NEES and the coverage of the worst axis."""
    for kind in dict.fromkeys(each.kind for each in spreads):
        of_kind = [each for each in spreads if each.kind == kind]
        what = f'covariance in {kind}, {len(of_kind)} trials'
        ratio = float(np.mean([each.nees for each in of_kind])) / 6
        yield Goal(f'{what}: NEES over 6', ratio, MOST_NEES)
        yield Goal(f'{what}: 1 over that', 1 / ratio, 1 / LEAST_NEES)
        one, two = within(of_kind, 1), within(of_kind, 2)
        off = max(68.0 - one.min(), one.max() - 68.0)
        worst = f'{one.min():.0f} to {one.max():.0f} %'
        yield Goal(f'{what}: 68 % covers {worst}, off by', off, MOST_68 - 68.0, 'points')
        yield Goal(f'{what}: 95 % misses at most', 100 - two.min(), 100 - LEAST_95, '%')
