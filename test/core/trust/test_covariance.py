import numpy as np
import pytest
from clouds import surface
from costs import normal_balance

from idem_ros.core import Cloud
from idem_ros.core.trust.covariance import LEVERAGE, covariance_of, firm_and_loose, scatter_of
from idem_ros.core.trust.observability import observability_of
from idem_ros.core.trust.regions import by_region


@pytest.mark.parametrize(('size', 'held'), [(6, 6), (6, 4), (12, 11), (6, 0)])
def test_the_scatter_is_that_of_solving_without_each_region(rng, size, held):
    pulls, halves = rng.normal(size=(40, size)), rng.normal(size=(40, size, 9))
    stiffness = halves @ halves.transpose(0, 2, 1)
    firm = np.linalg.qr(rng.normal(size=(size, size)))[0][:, :held]
    firm = firm / np.sqrt(np.einsum('ik,gij,jk->k', firm, stiffness, firm))
    roots = 1.5 * firm
    moves = [
        roots @ np.linalg.solve(np.eye(held) - LEVERAGE * firm.T @ S @ firm, roots.T @ g)
        for g, S in zip(pulls, stiffness, strict=True)
    ]
    expected = np.sum([np.outer(move, move) for move in moves], axis=0)
    found = scatter_of(pulls, stiffness, firm, roots)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


@pytest.fixture
def at_the_minimum(rng):
    """A cost, a pose, and what is observed there and linearised by regions."""
    target, source = Cloud(surface(rng, 1200, 0.01)), Cloud(surface(rng, 1100, 0.01))
    cost, T = normal_balance(target, source, 0.3), np.eye(4)
    observability = observability_of(cost, T)
    met = [side.moments for side in cost.balls.agreement(T, 0.3)]
    return cost, T, observability, by_region(cost, T, observability, met)


def test_firm_motions_have_unit_stiffness_and_say_how_far_they_move_the_surfaces(at_the_minimum):
    *_, observability, regions = at_the_minimum
    matrix = regions.total.matrix
    firm, moved, loose = firm_and_loose(observability.constrained, matrix)
    np.testing.assert_allclose(firm.T @ matrix @ firm, np.eye(6), atol=1e-9)
    found = np.linalg.norm(np.linalg.solve(observability.units, firm), axis=0)
    np.testing.assert_allclose(moved, found, rtol=1e-9)
    assert loose.shape == (6, 0)
    none = firm_and_loose(observability.constrained[:, :0], matrix)
    assert [each.shape[-1] for each in none] == [0, 0, 0]


def test_half_the_pulls_leave_half_the_deviations(at_the_minimum):
    *where, regions = at_the_minimum
    found = covariance_of(*where, regions, 0.0)
    half = covariance_of(*where, regions._replace(pulls=regions.pulls / 2), 0.0)
    np.testing.assert_allclose(half, found / 4, rtol=1e-2, atol=1e-3 * np.abs(found).max())


def test_a_motion_that_balls_with_lines_hold_is_less_sure_than_the_jackknife_says(at_the_minimum):
    *where, regions = at_the_minimum
    lines, without = (
        regions._replace(ruled=share * regions.stiffness.sum(axis=0)) for share in (0.8, 0.0)
    )
    wide, narrow = (covariance_of(*where, each, 0.5) for each in (lines, without))
    np.testing.assert_allclose(wide, (1 + 0.5 * 0.64 / 0.2) * narrow, rtol=1e-3, atol=1e-9)
