import naive
import numpy as np
import pytest
from clouds import motion, surface
from costs import ball_cost, joint_entropy
from scipy.spatial import cKDTree

from idem_ros.core.geometry import se3
from idem_ros.core.geometry.grid import build_grid
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.candidates import candidate_pairs, still_hold
from idem_ros.core.metric.cloud import Cloud, neighbourhoods
from idem_ros.core.metric.entropy import entropy
from idem_ros.core.metric.moments import AS_MEASURED, ball_moments, rotated
from idem_ros.core.solve.block_sums import SUMS, of_both
from idem_ros.core.solve.linearization import NOT_MET, linearize
from idem_ros.core.solve.pair import _are_alike
from idem_ros.core.tuning import SOLVER
from idem_ros.core.workers import ALONE

UPPER = np.triu_indices(3)
EVERYONE = np.arange(1000, dtype=np.int32)
ORIGIN = (0.0, 0.0, 0.0)


def as_tuple(k, s, outer):
    return np.r_[k, s, outer[UPPER]]


def test_moments_equal_sums_over_one_point_at_a_time(rng):
    points, weights = rng.random((300, 3)), rng.random((300, 7))
    for centre in points[:10]:
        unit, got = ball_moments(tuple(centre), points, weights, EVERYONE, 0, 300, 0.3**2)
        expected = naive.moments(points, weights[:, 0], weights[:, 1:], centre, 0.3)
        np.testing.assert_allclose(got, as_tuple(*expected), atol=1e-12)
        assert ball_moments(tuple(centre), points, AS_MEASURED, EVERYONE, 0, 300, 0.3**2)[
            1
        ] == pytest.approx(unit)
        expected = naive.moments(points, np.ones(300), np.zeros((300, 6)), centre, 0.3)
        np.testing.assert_allclose(unit, as_tuple(*expected), atol=1e-12)


def test_rotated_moments_are_those_of_the_rotated_points(rng):
    points, R = rng.random((50, 3)), motion(rng, 40, 0)[:3, :3].copy()
    got = rotated(R, ball_moments(ORIGIN, points, AS_MEASURED, EVERYONE, 0, 50, 9.0)[0])
    expected, _ = ball_moments(ORIGIN, points @ R.T, AS_MEASURED, EVERYONE, 0, 50, 9.0)
    np.testing.assert_allclose(got, expected, atol=1e-12)


@pytest.mark.parametrize(('n_target', 'n_source'), [(80, 50), (50, 80), (1, 30)])
def test_candidates_are_all_pairs_within_reach_both_ways(rng, n_target, n_source):
    target, source = rng.random((n_target, 3)), rng.random((n_source, 3))
    T, reach = motion(rng, 40, 0.1), 0.3
    grids = [build_grid(points, reach)[0] for points in (target, source)]
    pairs = candidate_pairs(*grids, T, reach, ALONE)
    moved = se3.transform_points(T, grids[1].points)
    near = np.linalg.norm(grids[0].points[:, None] - moved[None], axis=2) <= reach
    for candidates, expected in ((pairs.of_target, near), (pairs.of_source, near.T)):
        assert candidates.first[-1] == near.sum()
        for i, row in enumerate(expected):
            members = candidates.member[candidates.first[i] : candidates.first[i + 1]]
            np.testing.assert_array_equal(np.sort(members), np.flatnonzero(row))


def test_candidates_grow_where_there_are_more_than_expected(rng):
    target, source = rng.random((400, 3)) * 0.1, rng.random((60, 3)) * 0.1
    grids = [build_grid(points, 1.0)[0] for points in (target, source)]
    assert candidate_pairs(*grids, np.eye(4), 1.0, ALONE).of_source.first[-1] == 400 * 60


def test_candidates_hold_until_a_point_has_moved_by_the_skin(rng):
    grid, _ = build_grid(rng.random((50, 3)) * 10, 1.0)
    pairs = candidate_pairs(grid, grid, np.eye(4), 1.0, ALONE)
    assert still_hold(pairs, motion(rng, 0, 0.099), 0.1)
    assert not still_hold(pairs, motion(rng, 0, 0.101), 0.1)
    assert not still_hold(pairs, motion(rng, 1.0, 0), 0.1)  # 10 m away, 1 degree is 0.17 m


@pytest.mark.parametrize('n', [1, 3, 4, 5, 50])
def test_entropy_is_equation_4(rng, n):
    members = rng.random((n, 3))
    k, s, outer = naive.moments(members, np.ones(n), np.zeros((n, 6)), members[0], 10)
    got = entropy(tuple(as_tuple(k, s, outer)), 0.5)
    assert got == pytest.approx(naive.entropy(members, 0.5), rel=1e-9, abs=1e-12)


def linearized(target, source, cost, weights=AS_MEASURED):
    """Gradient and matrix of the target's side."""
    r = np.sqrt(cost.r2)
    (own,) = neighbourhoods([Cloud(target)], r)
    others = build_grid(source - Cloud(target).origin, r)[0].points
    first = np.arange(len(target) + 1) * len(source)
    member = np.tile(np.arange(len(source), dtype=np.int32), len(target))
    side = (own.grid.points, own.own), (others, weights, first, member)
    nobody = np.empty(0, np.int64)
    sums, here = tuple(np.zeros((2, 1, 1, SUMS))), np.eye(4)[None]
    chosen, group = (np.arange(len(target)), nobody), np.zeros(len(target), np.int64)
    linearize((side, side), NOT_MET, here, cost, chosen, (group, group), sums)
    _, (gradient,), (matrix,) = of_both(*sums, here)
    return gradient, matrix


@pytest.mark.parametrize('noise', [0.0, 0.3])
def test_the_gradient_is_the_finite_difference_with_members_held(rng, noise):
    target, source, r = surface(rng, 150, 0.02), surface(rng, 120, 0.02) + 0.03, 0.35
    origin = Cloud(target).origin
    source = source - origin
    target = target - origin
    fixed = [naive.ball(target, p, r) for p in target]
    moving = [naive.ball(source, p, r) for p in target]

    def q(twist):
        moved = [se3.transform_points(se3.exp(twist), m) for m in moving]
        return naive.held_q(target, fixed, moved, r, (noise * r) ** 2)

    step = 1e-5
    expected = [(q(step * e) - q(-step * e)) / (2 * step) for e in np.eye(6)]
    gradient, _ = linearized(target, source, ball_cost(r, noise))
    np.testing.assert_allclose(gradient, expected, rtol=1e-6, atol=1e-6)


def test_the_gradient_of_both_sides_is_the_finite_difference(rng):
    """Of clouds with raw moments: clusters tighter than any change of membership."""
    knots = rng.random((40, 3))
    target = np.vstack([knots + rng.normal(size=(40, 3)) * 0.003 for _ in range(6)])
    T = motion(rng, 5, 0.004)
    source = np.vstack([knots + rng.normal(size=(40, 3)) * 0.003 for _ in range(4)])
    source = se3.transform_points(se3.inverse(T), source)
    clouds = [Cloud(points).reduced(0.02) for points in (target, source)]
    cost = joint_entropy(*clouds, 0.2)
    T_origins = T.copy()
    T_origins[:3, 3] += T[:3, :3] @ clouds[1].origin - clouds[0].origin

    def q(twist):
        return held_q_of_voxels(
            *clouds, T_origins, se3.exp(twist) @ T_origins, 0.2, cost.ball_cost.noise
        )

    step = 1e-6
    expected = [(q(step * e) - q(-step * e)) / (2 * step) for e in np.eye(6)]
    gradient, matrix = cost.linearize(T_origins)
    np.testing.assert_allclose(gradient, expected, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(matrix, matrix.T, rtol=1e-9)
    assert np.linalg.eigvalsh(matrix)[0] > 0


def held_q_of_voxels(target, source, T_members, T, r, noise):
    """Joint entropies of voxels that carry moments, members held as they are at T_members."""
    total = 0.0
    for a, b, T_m, T_now in (
        (target, source, T_members, T),
        (source, target, se3.inverse(T_members), se3.inverse(T)),
    ):
        held, moved = (se3.transform_points(transform, b.points) for transform in (T_m, T_now))
        R = T_now[:3, :3]
        for p in a.points:
            own, other = (np.linalg.norm(x - p, axis=1) <= r for x in (a.points, held))
            if other.any():
                positions = np.vstack([a.points[own], moved[other]])
                counts = np.r_[a._weights[own, 0], b._weights[other, 0]]
                within = sum(naive.symmetric(c) for c in a._weights[own, 1:])
                within = within + sum(R @ naive.symmetric(c) @ R.T for c in b._weights[other, 1:])
                total += naive.entropy_of_moments(positions, counts, within, r, noise)
    return total


@pytest.mark.parametrize('weights', [AS_MEASURED, np.tile(AS_MEASURED, (5, 1))])
@pytest.mark.parametrize('apart', [float('inf'), 0.35])
@pytest.mark.parametrize('tangential', [False, True])
def test_gradient_and_matrix_of_one_ball_are_those_written_out(rng, tangential, apart, weights):
    target, source, r = rng.random((6, 3)) * 0.1, rng.random((5, 3)) * 0.1, 0.3
    origin = Cloud(target).origin
    source, target = source - origin, target - origin
    joint = np.vstack([target, source])
    sigma = np.cov(joint.T, bias=True)
    W = np.linalg.inv(sigma)
    c_det = (2 * np.pi * np.e) ** 3 * np.linalg.det(sigma / r**2)
    rho = c_det / (1 + c_det)
    if tangential:
        W = W @ W @ W / np.trace(W) ** 2
        between = np.linalg.norm(target.mean(axis=0) - source.mean(axis=0))
        rho /= 1 + (between / (apart * r)) ** 4
    J = [np.c_[-se3.skew(x), np.eye(3)] for x in source]
    pulls = [j.T @ W @ (x - joint.mean(axis=0)) for j, x in zip(J, source, strict=True)]
    J_mean = np.mean(J, axis=0)

    cost = ball_cost(r, 0.0, tangential, apart)
    gradient, matrix = linearized(target, source, cost, weights)

    np.testing.assert_allclose(gradient, 6 * rho / 11 * np.sum(pulls, axis=0), rtol=1e-8)
    expected = 6 * rho * 5 * (1 - 5 / 11) / 11 * J_mean.T @ W @ J_mean
    np.testing.assert_allclose(matrix, expected, rtol=1e-8)


def test_own_means_are_moved_for_curvature_as_far_as_the_others_spread(rng):
    target, source, r = rng.random((6, 3)) * 0.1, rng.random((5, 3)) * 0.1, 0.3
    origin = Cloud(target).origin
    source, target = source - origin, target - origin
    W = np.linalg.inv(np.cov(np.vstack([target, source]).T, bias=True))
    c_det = (2 * np.pi * np.e) ** 3 / np.linalg.det(W * r**2)
    J, pull = [np.c_[-se3.skew(x), np.eye(3)] for x in source], np.zeros(6)
    for p in target:
        spreads = [np.mean(np.sum((points - p) ** 2, axis=1)) for points in (source, target)]
        ratio = np.clip(spreads[0] / spreads[1], 0.5, 2.0)
        middle = p + (np.sum(source - p, axis=0) + ratio * np.sum(target - p, axis=0)) / 11
        pull += sum(j.T @ W @ (x - middle) for j, x in zip(J, source, strict=True))

    gradient, _ = linearized(target, source, ball_cost(r, 0.0, curvature=2.0))

    np.testing.assert_allclose(gradient, c_det / (1 + c_det) / 11 * pull, rtol=1e-8)


def test_curvature_counts_only_where_samplings_are_not_alike(rng):
    even = surface(rng, 20_000)
    tree, kept = cKDTree(even), np.ones(len(even), bool)
    for i in range(len(even)):
        if kept[i]:
            kept[tree.query_ball_point(even[i], 0.05)] = False
            kept[i] = True
    even, radius = Cloud(even[kept]), 0.08
    first, second = (Cloud(surface(rng, len(even))) for _ in range(2))

    assert not _are_alike(Balls(first, even, radius), SOLVER.spread_gap)
    assert not _are_alike(Balls(even, first, radius), SOLVER.spread_gap)
    assert _are_alike(Balls(first, second, radius), SOLVER.spread_gap)


def test_the_value_of_the_cost_is_q_tot(rng):
    """Without noise, of points as measured: Eq. 8."""
    target, source, r = Cloud(surface(rng, 300)), Cloud(surface(rng, 250)), 0.4
    T = motion(rng, 5, 0.1)
    cost = joint_entropy(target, source, r, noise=0.0)
    moved = se3.transform_points(T, source.points)
    expected = naive.q_per_point(target.points, moved, r, r).sum()
    assert cost.value(T) == pytest.approx(expected, rel=1e-9)


def test_a_step_within_the_majorised_cost_does_not_raise_it(rng):
    """With members held: noise far below the balls, few enter or leave."""
    target, source = Cloud(surface(rng, 900)), Cloud(surface(rng, 800))
    cost, T = joint_entropy(target, source, 0.4), motion(rng, 4, 0.05)
    for _ in range(5):
        value, (gradient, matrix) = cost.value(T), cost.linearize(T)
        T = se3.exp(-np.linalg.solve(matrix, gradient)) @ T
        assert cost.value(T) < value
