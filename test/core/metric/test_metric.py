import naive
import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.core import (
    Cloud,
    InvalidCloud,
    InvalidConfig,
    InvalidTransform,
    fourth_neighbor_distance,
    q_per_point,
    q_tot,
    search_radius,
)
from idem_ros.core.geometry import se3


def plane(rng, n):
    return np.c_[rng.random((n, 2)), np.zeros(n)]


CLOUDS = {
    'random': lambda rng: (rng.random((90, 3)), rng.random((70, 3))),
    'surface': lambda rng: (surface(rng, 150), surface(rng, 60)),
    'planar': lambda rng: (plane(rng, 80), plane(rng, 60)),
    'collinear': lambda rng: (np.outer(np.arange(40), (1, 2, 3.0)), rng.random((40, 3)) * 40),
    'duplicates': lambda rng: (np.repeat(rng.random((30, 3)), 3, axis=0), rng.random((40, 3))),
    'disjoint': lambda rng: (rng.random((40, 3)), rng.random((40, 3)) + 50),
    'lattice': lambda rng: (
        np.argwhere(np.ones((4, 4, 4))) * 0.1,
        np.argwhere(np.ones((3, 5, 4))) * 0.1,
    ),
    'spread out': lambda rng: (
        rng.random((60, 3)) * (1000, 1, 1),
        rng.random((60, 3)) * (1000, 1, 1),
    ),
}


@pytest.fixture(params=CLOUDS)
def pair(request, rng):
    return CLOUDS[request.param](rng)


@pytest.mark.parametrize('length_scale', ['radius', 'none'])
@pytest.mark.parametrize('a', [0.7, 1.0, 2.5])
def test_q_is_the_papers(pair, length_scale, a, rng):
    target, source = pair
    T = motion(rng, 3, 0.02)
    r = naive.search_radius(target, source, a)
    moved = source @ T[:3, :3].T + T[:3, 3]
    expected = naive.q_per_point(target, moved, r, r if length_scale == 'radius' else 1.0)

    q_target, q_source = q_per_point(target, source, T, a=a, length_scale=length_scale)

    # A line's determinant is zero but for the rounding of lengths to the sixth power.
    rounding = 1e-9 if length_scale == 'radius' else 1e-7
    np.testing.assert_allclose(np.r_[q_target, q_source], expected, rtol=1e-7, atol=rounding)
    assert q_tot(target, source, T, a=a, length_scale=length_scale) == pytest.approx(
        expected.sum(), rel=1e-7, abs=1e-6
    )


def test_radius_and_fourth_neighbor_are_the_papers(pair):
    target, source = pair
    assert fourth_neighbor_distance(target) == pytest.approx(
        naive.fourth_neighbor_distance(target)
    )
    assert search_radius(target, source, 1.3) == pytest.approx(
        naive.search_radius(target, source, 1.3)
    )


def test_two_identical_clouds_in_perfect_overlap_have_zero(rng):
    cloud = surface(rng, 400)
    assert q_tot(cloud, cloud) == pytest.approx(0, abs=1e-9)
    assert q_tot(cloud, cloud, motion(rng, 0, 0.05)) > 1


def test_two_separate_clouds_have_zero(rng):
    cloud = surface(rng, 400)
    assert q_tot(cloud, cloud + (10, 0, 0)) == 0


@pytest.mark.parametrize('length_scale', ['radius', 'none'])
def test_swapping_the_clouds_changes_nothing(rng, length_scale):
    target, source = surface(rng, 500, 0.01), surface(rng, 300, 0.01)
    T = motion(rng, 4, 0.03)
    forth = q_tot(target, source, T, length_scale=length_scale)
    back = q_tot(source, target, se3.inverse(T), length_scale=length_scale)
    assert back == pytest.approx(forth, rel=1e-9)


def test_moving_both_clouds_changes_nothing(rng):
    target, source = surface(rng, 500, 0.01), surface(rng, 300, 0.01)
    T, common = motion(rng, 4, 0.03), motion(rng, 130, 7)
    moved = se3.transform_points(common, target)
    assert q_tot(moved, source, common @ T) == pytest.approx(q_tot(target, source, T), rel=1e-9)


def test_is_dimensionless_with_the_radius_as_scale(rng):
    target, source = surface(rng, 300, 0.01), surface(rng, 300, 0.01)
    assert q_tot(1000 * target, 1000 * source) == pytest.approx(q_tot(target, source), rel=1e-9)


def test_map_coordinates_lose_no_digits(rng):
    target, source = surface(rng, 300, 0.01), surface(rng, 300, 0.01)
    far = np.array([1e6, -2e6, 1e3])
    # The coordinates themselves are rounded to 2e-10 there.
    assert q_tot(target + far, source + far) == pytest.approx(q_tot(target, source), rel=1e-6)


def test_a_prepared_cloud_gives_the_same_bits(rng):
    target, source = surface(rng, 300), surface(rng, 200)
    prepared = Cloud(target)
    first = q_tot(prepared, source)
    assert first == q_tot(prepared, source) == q_tot(target, source)


def test_points_that_are_not_finite_are_left_out_and_counted(rng):
    target, source = surface(rng, 300), surface(rng, 200)
    dirty = np.insert(
        target, [0, 100, 300], np.array([[np.nan] * 3, [np.inf, 0, 0], [0, 0, np.nan]]), axis=0
    )
    q_dirty, _ = q_per_point(dirty, source)
    q_clean, _ = q_per_point(target, source)
    assert Cloud(dirty).dropped == 3
    np.testing.assert_array_equal(np.isnan(q_dirty), ~np.isfinite(dirty).all(axis=1))
    np.testing.assert_allclose(q_dirty[np.isfinite(q_dirty)], q_clean, rtol=1e-9, atol=1e-12)
    assert q_tot(dirty, source) == pytest.approx(q_tot(target, source), rel=1e-9)


def test_one_point_has_no_fourth_neighbour_but_a_metric_with_a_radius(rng):
    with pytest.raises(InvalidCloud, match='1 points has no fourth neighbour'):
        q_tot([[0, 0, 0]], rng.random((20, 3)))
    assert q_tot([[0, 0, 0.0]], [[0, 0, 0.0]], radius=1.0) == 0


def test_points_all_in_one_place_have_no_entropy():
    assert q_tot(np.ones((10, 3)), np.ones((10, 3))) == 0


@pytest.mark.parametrize(
    ('points', 'message'),
    [
        (np.empty((0, 3)), 'none is finite'),
        (np.full((4, 3), np.nan), 'none is finite'),
        (np.zeros((4, 2)), r'shape \(4, 2\); it must be \(N, 3\)'),
        (np.zeros(3), r'shape \(3,\)'),
        (np.zeros((4, 3), complex), 'dtype is complex128'),
        ('bunny.ply', 'not an array of real numbers'),
        ([[0, 0, 0], [1, 2]], 'not an array of real numbers'),
    ],
)
def test_what_is_no_cloud_is_refused(points, message):
    with pytest.raises(InvalidCloud, match=message):
        Cloud(points)


@pytest.mark.parametrize(
    ('arguments', 'error', 'message'),
    [
        ({'a': 0}, InvalidConfig, 'a is 0'),
        ({'radius': -1.0}, InvalidConfig, 'radius is -1.0'),
        ({'radius': np.nan}, InvalidConfig, 'radius is nan'),
        ({'length_scale': 'mm'}, InvalidConfig, "length_scale is 'mm'"),
        ({'T_target_source': np.eye(3)}, InvalidTransform, r'shape \(3, 3\)'),
        ({'T_target_source': 2 * np.eye(4)}, InvalidTransform, 'last row'),
        ({'T_target_source': np.diag([1, 1, -1, 1])}, InvalidTransform, 'not rigid'),
        ({'T_target_source': np.full((4, 4), np.nan)}, InvalidTransform, 'not finite'),
    ],
)
def test_misuse_is_refused(rng, arguments, error, message):
    cloud = rng.random((20, 3))
    with pytest.raises(error, match=message):
        q_tot(cloud, cloud, **arguments)
