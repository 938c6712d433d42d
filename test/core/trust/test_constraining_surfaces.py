import numpy as np
import pytest

from idem_ros.core.trust.constraining_surfaces import FEW, HOLDING, holders_of
from idem_ros.core.trust.observability import Observability


def seen(along, of_target, observable):
    centres = 3 * np.arange(of_target), 5 * np.arange(len(along) - of_target)
    six = np.ones(6), np.zeros(6), np.ones(6)
    motions = np.diag(np.arange(1.0, 7.0))
    return Observability(*six, 0.0, motions, np.eye(6), 1.0, along, centres, observable)


@pytest.mark.parametrize('sample', [1, 7, 10**9])
@pytest.mark.parametrize(('count', 'of_target'), [(500, 300), (500, 0), (5, 2), (0, 0)])
def test_holders_are_those_that_all_but_a_few_are_measured_by(rng, sample, count, of_target):
    along = rng.normal(size=(count, 6)) ** 3
    along[:, 4] = 0.0  # nothing moves along itself
    observable = np.array([True, False, True, True, True, True])
    observability = seen(along, of_target, observable)
    found = holders_of(observability, sample)
    for n, k in enumerate(np.flatnonzero(observable)):
        moves = np.abs(along[:, k])
        most = np.sort(moves)[-min(FEW, count)] if count else 0.0
        motion = observability.motions[:, k] / (most or 1.0)
        np.testing.assert_allclose(found.motions[:, n], motion, rtol=1e-12)
        holding = (moves > HOLDING * most) & (most > 0.0)
        sides = np.flatnonzero(holding[:of_target]), np.flatnonzero(holding[of_target:])
        for side, rows in enumerate(sides):
            rows = rows[:: max(round(len(rows) / sample), 1)]
            mine = found.centres[side][found.motion[side] == n]
            np.testing.assert_array_equal(mine, observability.centres[side][rows])
