import numpy as np
import pytest

from idem_ros.core.geometry import se3
from idem_ros.smoothing.joining import TOLD, loops_of, way_along, windows_of


def line(xs, y=0.0):
    return [se3.translation((x, y, 0.0)) for x in xs]


@pytest.mark.parametrize(('count', 'size'), [(2, 6), (6, 6), (7, 6), (20, 6), (41, 4), (30, 2)])
def test_windows_cover_all_and_tell_each_pair_of_neighbours_once(count, size):
    windows = windows_of(count, size)
    assert {k for window, _ in windows for k in window} == set(range(count))
    assert all(len(window) == min(size, count) for window, _ in windows)
    told = [(window[i], window[j]) for window, pairs in windows for i, j in pairs]
    steps = [step for step in range(1, TOLD + 1) if size > step]
    if size > 3:
        assert sorted(told) == sorted((k, k + s) for s in steps for k in range(count - s))
    assert len(set(told)) == len(told)
    assert {(k, k + 1) for k in range(count - 1)} <= set(told)


def test_a_loop_is_the_nearest_of_each_earlier_pass():
    there, back = np.arange(0.0, 40.0, 2.0), np.arange(40.0, -2.0, -2.0)
    poses = np.array([*line(there), *line(back, y=1.0)])
    pairs = loops_of(poses, reach=3.0)
    assert (0, len(poses) - 1) in pairs
    for i, j in pairs:
        assert i < j
        if poses[j, 0, 3] < 30.0:  # before that the nearest are no 9 m of way before
            assert poses[i, 0, 3] == poses[j, 0, 3]
        assert way_along(poses)[j] - way_along(poses)[i] > 9.0
    assert len({j for _, j in pairs}) == len(pairs)


def test_what_was_tried_is_not_asked_for_again():
    poses = np.array([*line(np.arange(0.0, 20.0, 2.0)), *line(np.arange(20.0, 0.0, -2.0), 1.0)])
    pairs = loops_of(poses, reach=3.0)
    assert pairs
    assert loops_of(poses, 3.0, pairs) == []


def test_a_straight_way_has_no_loops():
    assert loops_of(np.array(line(np.arange(100.0))), reach=5.0) == []
