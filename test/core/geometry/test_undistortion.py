import naive
import numpy as np
import pytest

from idem_ros.core import InvalidCloud, InvalidConfig, InvalidTransform, undistort

TWISTS = {
    'drive and turn': (10.0, 0.5, -0.1, 0.05, -0.1, 1.6),
    'straight on': (20.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    'still': (0.0,) * 6,
    'hardly a turn': (1.0, 2.0, 3.0, 1e-12, 0.0, -1e-11),
    'turning over': (1.0, -2.0, 0.5, 20.0, 5.0, -8.0),
}


@pytest.fixture
def measured(rng):
    return rng.normal(size=(50, 3)) * 20.0, rng.uniform(-0.1, 0.1, 50)


@pytest.mark.parametrize('twist', TWISTS.values(), ids=TWISTS)
def test_each_point_moves_as_the_matrix_exponential_has_it(measured, twist):
    points, times = measured
    expected = naive.undistort(points, times, twist, 0.0)
    assert np.abs(undistort(points, times, twist) - expected).max() < 1e-11


@pytest.mark.parametrize(
    ('reference', 'time'),
    [('stamp', 0.0), ('begin', -0.02), ('middle', 0.03), ('end', 0.08), (0.05, 0.05)],
)
def test_points_come_into_the_frame_of_the_reference(measured, reference, time):
    points, _ = measured
    times = np.linspace(-0.02, 0.08, len(points))
    twist = TWISTS['drive and turn']
    undone = undistort(points, times, twist, reference)
    assert np.abs(undone - naive.undistort(points, times, twist, time)).max() < 1e-11


def test_a_still_wall_seen_by_a_moving_sensor_is_undone_to_the_wall(rng):
    wall = np.column_stack([np.full(200, 8.0), rng.uniform(-5, 5, (200, 2))])
    times, twist = np.linspace(0.0, 0.1, 200), TWISTS['drive and turn']
    seen = naive.undistort(wall, -times, twist, 0.0)  # the inverse motion of each instant
    assert np.abs(undistort(seen, times, twist) - wall).max() < 1e-11


def test_the_arguments_stay_as_they_were(measured):
    points, times = measured
    before = points.copy()
    undistort(points, times, TWISTS['drive and turn'])
    assert np.array_equal(points, before)


def test_points_in_single_precision_and_unsorted_times_are_taken(measured):
    points, times = (array.astype(np.float32) for array in measured)
    twist = TWISTS['drive and turn']
    expected = naive.undistort(points.astype(float), times.astype(float), twist, 0.0)
    assert np.abs(undistort(points, times, twist) - expected).max() < 1e-11


def test_a_point_that_is_not_finite_stays_so_and_needs_no_time(measured):
    points, times = measured
    points[3], times[3] = np.nan, np.nan
    undone = undistort(points, times, TWISTS['drive and turn'], 'end')
    assert np.isnan(undone[3]).all()
    assert np.isfinite(np.delete(undone, 3, axis=0)).all()


def test_no_points_are_undone_to_none():
    assert undistort(np.empty((0, 3)), [], TWISTS['drive and turn'], 'middle').shape == (0, 3)


@pytest.mark.parametrize(
    ('change', 'error', 'message'),
    [
        ({'points': np.zeros((4, 2))}, InvalidCloud, r'points have the shape \(4, 2\)'),
        ({'times': np.zeros(3)}, InvalidCloud, r'times have the shape \(3,\); it must be \(4,\)'),
        ({'times': [0, np.nan, 0, np.inf]}, InvalidCloud, '2 of 4 points have no finite time'),
        ({'times': ['a'] * 4}, InvalidCloud, 'times are not an array of numbers'),
        ({'twist': np.zeros(5)}, InvalidTransform, 'six finite numbers'),
        ({'twist': [0, 0, 0, 0, 0, np.nan]}, InvalidTransform, 'six finite numbers'),
        ({'reference': 'start'}, InvalidConfig, "reference is 'start'; it must be one of"),
        ({'reference': np.inf}, InvalidConfig, 'reference is inf'),
    ],
)
def test_what_is_no_sweep_is_refused_by_name(change, error, message):
    arguments = {
        'points': np.zeros((4, 3)),
        'times': np.zeros(4),
        'twist': np.zeros(6),
        'reference': 'stamp',
    }
    with pytest.raises(error, match=message):
        undistort(**{**arguments, **change})
