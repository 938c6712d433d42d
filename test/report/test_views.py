import numpy as np
import pytest
from clouds import surface

from idem_ros.refinement.q_tot_slice import QTotSlice
from idem_ros.report.views import draw_from_above, draw_slice, seen_from_above


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


def test_axes_say_their_units(rng):
    slice_ = QTotSlice(np.linspace(-1, 1, 3), rng.random((3, 3)), voxel_size=0.1, radius=0.3)
    clouds = surface(rng, 60), surface(rng, 60)
    labels = [
        label
        for figure in (
            draw_slice(slice_, np.zeros(2)),
            draw_from_above(*clouds, np.zeros(2), 1, ''),
        )
        for axes in figure.axes
        for label in (axes.get_xlabel(), axes.get_ylabel())
        if label
    ]
    assert labels == [
        *('shift in x [m]', 'shift in y [m]', 'q_tot [nat]'),
        *('x [m]', 'y [m]'),
    ]
