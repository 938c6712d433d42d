import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.core import Cloud, RegistrationConfig, q_tot
from idem_ros.core.se3 import inverse, transform_points
from idem_ros.evaluation.views import (
    STEPS,
    draw_from_above,
    draw_slice,
    seen_from_above,
    slice_around,
)

VOXELS = RegistrationConfig(voxel_size=0.1)


@pytest.fixture
def pair(rng):
    """Target, source, and where the source is."""
    T = motion(rng, 20.0, 0.5)
    return surface(rng, 600), transform_points(inverse(T), surface(rng, 600)), T


def test_a_slice_holds_q_tot_at_each_shift(pair):
    target, source, T = pair
    found = slice_around(*pair, T, 0.3, VOXELS)
    assert (found.voxel_size, found.radius) == (0.1, 0.3)
    clouds = [Cloud(points).reduced(0.1) for points in (target, source)]
    for row, column in ((0, 0), (3, STEPS - 1), (STEPS // 2, STEPS // 2)):
        shifted = T.copy()
        shifted[:2, 3] += found.shifts[column], found.shifts[row]
        expected = q_tot(*clouds, shifted, radius=0.3)
        np.testing.assert_allclose(found.q_tot[row, column], expected, rtol=1e-9)


def test_a_slice_reaches_as_far_as_the_guess_but_not_everywhere(pair):
    T_guess = pair[2].copy()
    T_guess[0, 3] += 1.0
    assert slice_around(*pair, T_guess, 0.3, VOXELS).shifts[-1] == pytest.approx(1.2)
    T_guess[0, 3] += 100.0
    assert slice_around(*pair, T_guess, 0.3, VOXELS).shifts[-1] == pytest.approx(3.0)


def test_a_map_far_larger_than_the_source_changes_nothing(pair, rng):
    target, source, T = pair
    near = slice_around(*pair, T, 0.3, VOXELS)
    far = np.vstack([target, rng.uniform(100, 200, (500, 3))])
    again = slice_around(far, source, T, T, 0.3, VOXELS)
    np.testing.assert_allclose(again.q_tot, near.q_tot, rtol=1e-9)


def test_of_large_clouds_coarser_voxels_are_taken(pair, monkeypatch):
    monkeypatch.setattr('idem_ros.evaluation.views.MOST_POINTS', 200)
    found = slice_around(*pair, pair[2], 0.3, VOXELS)
    assert found.voxel_size > 0.1
    assert found.radius > 0.3
    assert np.isfinite(found.q_tot).all()


def test_clouds_that_do_not_meet_have_a_slice_of_zeros(pair):
    target, source, T = pair
    found = slice_around(target + 1000.0, source, T, T, 0.3, VOXELS)
    np.testing.assert_array_equal(found.q_tot, 0.0)


def test_the_view_is_as_wide_as_the_source_or_some_radii(rng):
    points = rng.uniform(-1, 1, (1000, 3)) + (50, 0, 0)
    middle, half_width = seen_from_above(points, 1.0)
    np.testing.assert_allclose(middle, (50, 0), atol=0.1)
    assert 0.9 < half_width < 1.1
    assert seen_from_above(points, 0.01)[1] == pytest.approx(0.2)
    assert seen_from_above(points, 0.0)[1] == half_width
    assert seen_from_above(np.zeros((1, 3)), 1.0)[1] > 0


def test_walls_are_drawn_and_the_floor_is_left_out(rng):
    floor = np.column_stack([rng.uniform(-10, 10, (5000, 2)), np.zeros(5000)])
    wall = np.column_stack([np.full(1500, 3.0), rng.uniform(-10, 10, 1500), 4 * rng.random(1500)])
    figure = draw_from_above(np.vstack([floor, wall]), wall, np.zeros(2), 10.0, 'title')
    x = figure.axes[0].get_lines()[0].get_xdata()
    np.testing.assert_array_equal(x, 3.0)
    assert len(x) > 1000


def test_a_floor_alone_is_drawn(rng):
    floor = np.column_stack([rng.uniform(-10, 10, (500, 2)), np.zeros(500)])
    figure = draw_from_above(floor, floor[:0], np.zeros(2), 10.0, 'title')
    assert len(figure.axes[0].get_lines()[0].get_xdata()) == 500


def test_axes_say_their_units(pair):
    slice_ = slice_around(*pair, pair[2], 0.3, VOXELS)
    labels = [
        label
        for figure in (
            draw_slice(slice_, np.zeros(2)),
            draw_from_above(*pair[:2], np.zeros(2), 1, ''),
        )
        for axes in figure.axes
        for label in (axes.get_xlabel(), axes.get_ylabel())
        if label
    ]
    assert labels == [
        *('shift in x [m]', 'shift in y [m]', 'q_tot [nat]'),
        *('x [m]', 'y [m]'),
    ]
