import naive
import numpy as np
import pytest

from idem_ros.core.geometry.fourth_neighbor import mean_fourth_neighbor_distance
from idem_ros.core.geometry.grid import build_grid, neighbours, room_for
from idem_ros.core.geometry.voxels import reduce_to_voxels
from idem_ros.core.metric.moments import AS_MEASURED


@pytest.mark.parametrize('extent', [1, 30, 1e5])
@pytest.mark.parametrize('cell', [0.2, 0.9, 5.0])
def test_neighbours_are_those_that_a_look_at_all_points_finds(rng, extent, cell):
    points = rng.random((300, 3)) * (extent, 1, 2)
    grid, order = build_grid(points, cell)
    np.testing.assert_array_equal(grid.points, points[order])
    found, rows = room_for(grid)
    outside = (points.min(axis=0) - 0.15, points.max(axis=0) + 0.15, points[0] + 1e6)
    for centre in (*points[:15], *outside):
        for r in (cell, 0.6 * cell):
            n = neighbours(*centre, grid, r**2, found, rows)
            expected = np.flatnonzero(np.linalg.norm(grid.points - centre, axis=1) <= r)
            np.testing.assert_array_equal(np.sort(found[:n]), expected)


FOURTH = {
    'even': lambda rng: rng.random((400, 3)),
    'five points': lambda rng: rng.random((5, 3)),
    'with lonely points': lambda rng: np.vstack([rng.random((300, 3)), rng.random((9, 3)) * 1e4]),
    'uneven': lambda rng: rng.normal(size=(400, 3)) ** 5,
    'mostly in one place': lambda rng: np.vstack([np.zeros((300, 3)), rng.random((40, 3))]),
    'duplicates': lambda rng: np.repeat(rng.random((60, 3)), 6, axis=0),
    'lattice': lambda rng: np.argwhere(np.ones((6, 6, 6))).astype(float),
}


@pytest.mark.parametrize('name', FOURTH)
def test_the_fourth_neighbour_is_that_of_a_look_at_all_points(rng, name):
    points = FOURTH[name](rng)
    expected = naive.fourth_neighbor_distance(points)
    assert mean_fourth_neighbor_distance(points) == pytest.approx(expected, rel=1e-12, abs=1e-300)


def test_the_fourth_neighbour_of_a_sample_is_about_that_of_all(rng):
    points = rng.random((20000, 3))
    exact = mean_fourth_neighbor_distance(points)
    assert mean_fourth_neighbor_distance(points, 2000) == pytest.approx(exact, rel=0.03)


def test_voxels_hold_the_moments_of_their_points(rng):
    points = rng.random((500, 3)) * (3, 1, 1)
    expected = naive.voxels(points, 0.25)
    voxels = reduce_to_voxels(points, AS_MEASURED, 0.25)
    assert len(voxels.mean) == len(expected)
    cells = np.floor((voxels.mean - points.min(axis=0)) / 0.25).astype(int)
    for cell, mean, raw in zip(cells, *voxels, strict=True):
        m, n, s = expected[tuple(cell)]
        assert raw[0] == n
        np.testing.assert_allclose(mean, m, atol=1e-12)
        np.testing.assert_allclose(naive.symmetric(raw[1:]), s, atol=1e-12)


def test_voxels_of_voxels_hold_the_moments_of_all_points(rng):
    points = rng.random((500, 3))
    mean, raw = reduce_to_voxels(*reduce_to_voxels(points, AS_MEASURED, 0.1), 2.0)
    np.testing.assert_allclose(mean, [points.mean(axis=0)], atol=1e-12)
    assert raw[0, 0] == 500
    expected = 500 * np.cov(points.T, bias=True)
    np.testing.assert_allclose(naive.symmetric(raw[0, 1:]), expected, atol=1e-10)
