import numpy as np
import pytest
from clouds import motion, surface
from costs import normal_balance

from idem_ros.core import Cloud
from idem_ros.core.geometry import se3
from idem_ros.core.metric.noise import LEAST_MEMBERS, LEAST_SPREAD
from idem_ros.core.trust.observability import observability_of
from idem_ros.core.trust.regions import LEAST_REGION, REGION, by_region, groups_of


@pytest.mark.parametrize('period', [2, 16])
def test_regions_are_cubes_in_the_targets_frame_that_repeat(rng, period):
    clouds = Cloud(surface(rng, 900, 0.01)), Cloud(surface(rng, 800, 0.01))
    cost, T = normal_balance(*clouds, 0.15), motion(rng, 5.0, 0.05)
    observability = observability_of(cost, T)
    groups, places = groups_of(cost.balls, T, observability, period)
    edge = max(REGION * observability.lever_arm, LEAST_REGION * cost.balls.radius)
    target, source = (cloud.grid.points for cloud in cost.balls.clouds)
    points = np.vstack([target, se3.transform_points(T, source)])
    cells = np.floor(points / edge).astype(int) % period
    _, number = np.unique(cells[:, ::-1], axis=0, return_inverse=True)
    line, region = np.divmod(np.concatenate(groups), len(places))
    np.testing.assert_array_equal(region, number.ravel())
    own = np.vstack([cloud.own for cloud in cost.balls.clouds])
    np.testing.assert_array_equal(line, [is_line(row) for row in own])
    means = [points[region == g].mean(axis=0) for g in range(len(places))]
    np.testing.assert_allclose(places, means, atol=1e-9)


def is_line(moments):
    """Whether the two smaller variances, over the greatest, are those of no surface."""
    n, mean, square = moments[0], moments[1:4] / moments[0], np.empty((3, 3))
    square[np.triu_indices(3)] = square.T[np.triu_indices(3)] = moments[4:] / n
    spread = np.linalg.eigvalsh(square - np.outer(mean, mean))
    minors = spread[0] * spread[1] + spread[0] * spread[2] + spread[1] * spread[2]
    return n < LEAST_MEMBERS or minors <= LEAST_SPREAD * spread.sum() ** 2


def test_regions_add_up_to_the_linearisation(rng):
    target, source = Cloud(surface(rng, 1200, 0.01)), Cloud(surface(rng, 1100, 0.01))
    cost, T = normal_balance(target, source, 0.3), np.eye(4)
    met = [side.moments for side in cost.balls.agreement(T, 0.3)]
    regions = by_region(cost, T, observability_of(cost, T), met)
    gradient, matrix = cost.linearize(T)
    np.testing.assert_allclose(regions.pulls.sum(axis=0), gradient, atol=1e-9)
    np.testing.assert_allclose(regions.stiffness.sum(axis=0), matrix, rtol=1e-9)
