import naive
import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.core import se3
from idem_ros.core.grid import build_grid
from idem_ros.core.kernels import ball_moments, cross_moments, entropy
from idem_ros.core.linearization import SUMS, linearize, unpack
from idem_ros.core.voxels import reduce_to_voxels

UPPER = np.triu_indices(3)


def as_tuple(k, s, outer):
    return np.r_[k, s, outer[UPPER]]


@pytest.mark.parametrize('extent', [1, 30, 1e5])
def test_ball_moments_equal_a_loop_over_all_points(rng, extent):
    points = rng.random((300, 3)) * (extent, 1, 2)
    weight, scatter = rng.random(300), rng.random((300, 6))
    for cell in (0.2, 0.9, 5.0):
        grid, order = build_grid(points, weight, scatter, cell)
        np.testing.assert_array_equal(grid.points, points[order])
        for centre in (*points[:15], points.min(axis=0) - 0.15, points.max(axis=0) + 0.15):
            for r in (cell, 0.6 * cell):
                expected = as_tuple(*naive.moments(points, weight, scatter, centre, r))
                np.testing.assert_allclose(ball_moments(*centre, grid, r), expected, atol=1e-9)


def test_cross_moments_are_those_of_the_moved_points(rng):
    points, T = rng.random((200, 3)), motion(rng, 40, 0.3)
    grid, _ = build_grid(points, np.ones(200), np.empty((0, 6)), 0.3)
    moved = se3.transform_points(T, points)
    for centre in moved[:20]:
        expected = as_tuple(*naive.moments(moved, np.ones(200), np.zeros((200, 6)), centre, 0.3))
        R = np.ascontiguousarray(T[:3, :3])
        got = cross_moments(centre, grid, R, T[:3, 3], 0.3)
        np.testing.assert_allclose(got, expected, atol=1e-10)


@pytest.mark.parametrize('n', [1, 3, 4, 5, 50])
def test_entropy_is_equation_4(rng, n):
    members = rng.random((n, 3))
    k, s, outer = naive.moments(members, np.ones(n), np.zeros((n, 6)), members[0], 10)
    got = entropy(tuple(as_tuple(k, s, outer)), 0.5)
    assert got == pytest.approx(naive.entropy(members, 0.5), rel=1e-9, abs=1e-12)


def test_voxels_hold_the_moments_of_their_points(rng):
    points = rng.random((500, 3)) * (3, 1, 1)
    expected = naive.voxels(points, 0.25)
    voxels = reduce_to_voxels(points, 0.25)
    assert len(voxels.mean) == len(expected)
    cells = np.floor((voxels.mean - points.min(axis=0)) / 0.25).astype(int)
    for cell, mean, count, scatter in zip(cells, *voxels, strict=True):
        m, n, s = expected[tuple(cell)]
        assert count == n
        np.testing.assert_allclose(mean, m, atol=1e-12)
        np.testing.assert_allclose(naive.symmetric(scatter), s, atol=1e-12)


def linearized(target, source, r, noise):
    """Gradient and matrix of the target's side, from unit points."""
    n = len(target)
    own_grid, order = build_grid(target, np.ones(n), np.empty((0, 6)), r)
    own = np.array([ball_moments(*p, own_grid, r) for p in own_grid.points])
    grid, _ = build_grid(source, np.ones(len(source)), np.empty((0, 6)), r)
    sums = np.zeros(SUMS)
    linearize(own_grid.points, own, grid, np.eye(3), np.zeros(3), r, r, noise, 0, n, sums)
    return unpack(sums)


@pytest.mark.parametrize('noise', [0.0, 0.01])
def test_the_gradient_is_the_finite_difference_with_members_held(rng, noise):
    target, source, r = surface(rng, 150, 0.02), surface(rng, 120, 0.02) + 0.03, 0.35
    fixed = [naive.ball(target, p, r) for p in target]
    moving = [naive.ball(source, p, r) for p in target]

    def q(twist):
        moved = [se3.transform_points(se3.exp(twist), m) for m in moving]
        return naive.held_q(target, fixed, moved, r, noise)

    step = 1e-5
    expected = [(q(step * e) - q(-step * e)) / (2 * step) for e in np.eye(6)]
    gradient, _ = linearized(target, source, r, noise)
    np.testing.assert_allclose(gradient, expected, rtol=1e-6, atol=1e-6)


def test_the_matrix_is_symmetric_and_has_no_negative_direction(rng):
    _, matrix = linearized(surface(rng, 150, 0.02), surface(rng, 120, 0.02), 0.35, 1e-6)
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix)[0] > 0


def test_the_matrix_is_that_of_the_moving_means(rng):
    """One ball: rho k_B (1 - k_B / k) / k J^T W J, written out with matrices."""
    target, source, r = rng.random((6, 3)) * 0.1, rng.random((5, 3)) * 0.1, 1.0
    joint = np.vstack([target, source])
    sigma = np.cov(joint.T, bias=True)
    c_det = (2 * np.pi * np.e) ** 3 * np.linalg.det(sigma)
    J = np.c_[-se3.skew(source.mean(axis=0)), np.eye(3)]
    f = c_det / (1 + c_det) * 5 * (1 - 5 / 11) / 11
    _, matrix = linearized(target, source, r, 0.0)
    np.testing.assert_allclose(matrix, 6 * f * J.T @ np.linalg.inv(sigma) @ J, rtol=1e-9)
