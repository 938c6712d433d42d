import pytest

from benchmarks.browser import NoBrowser
from benchmarks.viewer_rate import NoWebGL, measure


def test_the_viewer_is_measured_while_it_turns_and_with_all_points():
    try:
        goals = measure(500, seconds=0.2, frames=2)
    except (NoBrowser, NoWebGL) as error:
        pytest.skip(str(error))
    assert [goal.unit for goal in goals] == ['ms', 'ms', 'MB']
    assert all(goal.measured > 0 for goal in goals)
    assert goals[2].reached
