from types import SimpleNamespace

import numpy as np
import pytest
from spinning import COLUMNS, SWEEP, sweep

from idem_ros.messages.point_times import NoTimes, azimuth_times

RULE = SimpleNamespace(turn=SWEEP, stamp_at='auto')
MIRRORED = np.array([1.0, -1.0, 1.0])


@pytest.mark.parametrize('order', ['rows', 'columns'])
@pytest.mark.parametrize(('mirror', 'way'), [(1.0, ' clockwise'), (MIRRORED, 'counterclockwise')])
def test_azimuths_tell_the_times_of_points_in_their_order(order, mirror, way):
    points, truth = sweep(order)
    times, said = azimuth_times(points * mirror, RULE)
    off = times - truth
    assert np.ptp(off) < 1e-9
    assert abs(off[0]) < 2.0 * SWEEP / COLUMNS
    assert way in said


def test_a_part_of_a_turn_lasts_a_part_of_its_time():
    points, truth = sweep('columns')
    seen = truth < 0.4 * SWEEP
    times, _ = azimuth_times(points[seen], RULE)
    np.testing.assert_allclose(times, truth[seen], atol=1e-9)


def test_the_stamp_may_be_at_the_end_of_a_turn():
    points, truth = sweep('columns')
    times, _ = azimuth_times(points, SimpleNamespace(turn=SWEEP, stamp_at='end'))
    np.testing.assert_allclose(times, truth - truth.max(), atol=1e-9)


def test_points_in_no_order_of_azimuths_have_no_times():
    points, _ = sweep('shuffled')
    with pytest.raises(NoTimes, match='not in the order of their azimuths'):
        azimuth_times(points, RULE)


def test_points_that_do_not_turn_have_no_times():
    points = np.stack([np.full(50, 5.0), np.linspace(-0.5, 0.5, 50), np.zeros(50)], axis=1)
    with pytest.raises(NoTimes, match='not in the order'):
        azimuth_times(points, RULE)
