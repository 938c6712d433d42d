"""Guesses that follow the last results: what they lead to, and when they are lost."""

from types import SimpleNamespace as Record

import numpy as np
import pytest

from idem_ros.core.geometry.se3 import exp, inverse, rotation_angle, translation
from idem_ros.refinement.last_results import LastResults

SECOND = 10**9
STEP = SECOND // 10
MAP = (('map', 'lidar'), 0, 1)
SCANS = (('lidar', 'lidar'), 0, 1)
FIRST = translation((100.0, 50.0, 2.0))
MOVE = exp(np.array([0.0, 0.0, 0.02, 1.5, 0.0, 0.0]))  # 15 m/s, in a bend


def pair(i, lost_after=1.0):
    guess = Record(T_target_source=None, T_first=FIRST, lost_after=lost_after)
    return Record(stamp=i * STEP, guess=guess)


def usable(T, radius=0.5):
    return Record(is_usable=True, T_target_source=T, radius=radius)


def unusable(T=None):
    said = Record(verdict=Record(value='misaligned'), reason='points disagree')
    return Record(is_usable=False, T_target_source=T, radius=0.5, assessment=said)


def truth(i):
    pose = FIRST
    for _ in range(i):
        pose = pose @ MOVE
    return pose


def driven(scans, of=MAP):
    last = LastResults()
    for i in range(scans):
        assert last.keep(pair(i), of, usable(truth(i))) == ''
    return last


def near(a, b):
    return np.linalg.norm(a[:3, 3] - b[:3, 3]) < 0.05 and rotation_angle(inverse(a) @ b) < 1e-3


def test_it_begins_with_the_pose_that_was_given():
    np.testing.assert_array_equal(LastResults().guess_for(pair(0), MAP), FIRST)
    np.testing.assert_array_equal(driven(3).guess_for(pair(3), (*MAP[:2], 2)), FIRST)


def test_a_fast_motion_is_carried_on_and_a_slow_one_is_not():
    assert near(driven(3).guess_for(pair(3), MAP), truth(3))
    slow = LastResults()
    for i in range(3):
        slow.keep(pair(i), MAP, usable(translation((0.1 * i, 0.0, 0.0))))
    np.testing.assert_array_equal(slow.guess_for(pair(3), MAP), translation((0.2, 0, 0)))


def test_a_result_that_is_not_usable_is_not_the_next_guess_and_the_motion_goes_on():
    last = driven(4)
    for i in range(4, 9):
        assert near(last.guess_for(pair(i), MAP), truth(i))
        assert last.keep(pair(i), MAP, unusable(truth(1))) == ''
    last.keep(pair(9), MAP, usable(truth(9)))
    assert near(last.guess_for(pair(10), MAP), truth(10))


def test_after_lost_after_the_guess_stays_and_it_is_said_since_when_and_why():
    last = driven(3)
    said = [last.keep(pair(i), MAP, unusable()) for i in range(3, 20)]
    assert said[:10] == [''] * 10  # the scan at 1.2 s is 1 s after the last usable one
    assert all(said[10:])
    assert said[10].startswith('no usable result for 1.1 s, since the scan at 0.200 s; the last')
    assert 'misaligned: points disagree' in said[10]
    guesses = [last.guess_for(pair(i), MAP) for i in (20, 30)]
    np.testing.assert_array_equal(*guesses)
    assert near(guesses[0], truth(12))
    assert last.keep(pair(31), MAP, usable(truth(31))) == ''


def test_without_a_limit_it_is_never_lost():
    last = driven(3)
    assert last.keep(pair(50, None), MAP, unusable()) == ''
    assert near(last.guess_for(pair(20, None), MAP), truth(20))


def test_a_source_whose_guess_comes_from_elsewhere_is_not_lost():
    last = driven(3)
    given = pair(50)
    given.guess.T_target_source = np.eye(4)
    assert last.keep(given, MAP, unusable()) == ''
    np.testing.assert_array_equal(last.guess_for(given, MAP), np.eye(4))


@pytest.mark.parametrize('radius', [0.1, 10.0])
def test_from_scan_to_scan_the_last_result_is_the_motion_itself(radius):
    last = LastResults()
    for i in range(3):
        last.keep(pair(i), SCANS, usable(MOVE, radius))
    np.testing.assert_array_equal(last.guess_for(pair(3), SCANS), MOVE)
