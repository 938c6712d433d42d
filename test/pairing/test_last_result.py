"""Guesses that go on from the last result, and where they begin."""

import numpy as np
import pytest
from clouds import motion, surface
from pairs import LATER, LONG_AGO, cloud
from poses import SECOND, pose_with_covariance, shifted, transform

from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.messages.stamps import NotYet
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.last_result import LastResult
from idem_ros.pairing.pairing import Pairing
from idem_ros.refinement.refiner import Refiner

CONFIG = GuessConfig()
MS = SECOND // 1000


def guess_of(guesses, stamp=7):
    return guesses.guess_for(stamp, 'map', 'lidar', CONFIG)


def test_without_a_pose_it_begins_with_the_identity():
    guesses = LastResult()
    guesses.forget_after(0)
    assert guesses
    assert guess_of(guesses).T_target_source is None
    assert guess_of(guesses).T_first is None


def test_before_the_first_result_the_pose_that_came_last_is_the_guess_whatever_its_stamp(rng):
    poses = [motion(rng, 20.0, 1.0) for _ in range(2)]
    guesses = LastResult()
    for stamp, pose in zip((10**18, 3), poses, strict=True):
        message = transform(stamp, pose)
        assert guesses.stamps(message) == []
        guesses.add(message)
    guesses.forget_after(3)
    guess = guess_of(guesses)
    assert guess.T_target_source is None
    np.testing.assert_allclose(guess.T_first, poses[1], rtol=0, atol=1e-14)
    guesses.forget_after(2)
    assert guess_of(guesses).T_first is None


def test_where_a_pose_is_needed_a_source_waits_for_it():
    guesses = LastResult(needs_pose=True)
    assert not guesses
    with pytest.raises(NotYet, match='no pose has come to start from'):
        guess_of(guesses)
    guesses.add(pose_with_covariance(0, 3.0, 'map'))
    assert guesses
    assert guess_of(guesses).T_first[0, 3] == 3.0
    assert (guess_of(guesses).target_frame, guess_of(guesses).source_frame) == ('map', '')


def test_every_pose_starts_anew_but_of_a_stream_of_transforms_only_the_first():
    guesses = LastResult()
    starts = [guess_of(guesses).start]
    for message in (
        transform(1, 1.0),
        transform(2, 2.0),
        pose_with_covariance(3, 3.0),
        transform(4, 4.0),
        pose_with_covariance(0, 5.0),
    ):
        guesses.add(message)
        starts.append(guess_of(guesses).start)
    changed = [a != b for a, b in zip(starts, starts[1:], strict=False)]
    assert changed == [True, False, True, False, True]
    assert guess_of(guesses).T_first[0, 3] == 5.0


def test_two_kinds_of_guess_never_share_a_start():
    first, second = LastResult(), LastResult(needs_pose=True)
    for guesses in (first, second):
        guesses.add(pose_with_covariance(0, 1.0))
    assert guess_of(first).start != guess_of(second).start


def test_a_pose_that_is_none_is_refused_and_the_one_before_serves_on():
    pairing = Pairing(guess_config=GuessConfig('initial_pose'))
    pairing.add_target(cloud(1))
    pairing.add_guess(pose_with_covariance(0, 2.0))
    bad = pose_with_covariance(5, 1.0)
    bad.pose.pose.orientation.w = 0.0
    pairing.add_guess(bad)
    (pair,) = pairing.add_source(cloud(6))
    assert pair.guess.T_first[0, 3] == 2.0
    (refusal,) = pairing.take_refusals()
    assert refusal.role == 'initial_guess'
    assert refusal.reason.startswith('initial guess: the quaternion')


def test_a_pose_serves_again_after_the_clock_was_set_back():
    pairing = Pairing(guess_config=GuessConfig('initial_pose'))
    pairing.add_target(cloud(1))
    pairing.add_guess(pose_with_covariance(LATER, 2.0))
    (first,) = pairing.add_source(cloud(LATER))
    (second,) = pairing.add_source(cloud(LONG_AGO))
    assert (first.jumps, second.jumps) == (0, 1)
    assert second.guess.T_first[0, 3] == 2.0


def test_a_reset_forgets_the_last_result():
    pairing = Pairing(guess_config=GuessConfig('initial_pose'))
    pairing.add_target(cloud(1))
    pairing.add_guess(pose_with_covariance(0, 2.0))
    assert pairing.reset()
    assert pairing.add_source(cloud(5)) == []
    assert pairing.why_it_waits() == 'initial guess: no pose has come to start from'
    assert not Pairing().reset()


def test_a_source_goes_on_from_the_last_result_until_another_pose_comes(rng):
    target = surface(rng, 1500)
    moves = [shifted(0.02 * i) for i in range(4)]
    pairing = Pairing(guess_config=GuessConfig('initial_pose'))
    refiner = Refiner(RegistrationConfig())
    pairing.add_target(cloud(1, 'map', target))
    pairing.add_guess(pose_with_covariance(0, moves[0], 'map'))
    refined = []
    for i, T in enumerate(moves):
        if i == 3:
            pairing.add_guess(pose_with_covariance(0, shifted(0.05), 'map'))
        scan = cloud(LONG_AGO + i * 100 * MS, 'lidar', transform_points(inverse(T), target))
        (pair,) = pairing.add_source(scan)
        refined.append(refiner.refine(pair))
    np.testing.assert_allclose(refined[0].T_guess, moves[0], atol=1e-12)
    for before, after in ((0, 1), (1, 2)):
        np.testing.assert_array_equal(
            refined[after].T_guess, refined[before].result.T_target_source
        )
        found = refined[after].result.T_target_source
        np.testing.assert_allclose(found, moves[after], rtol=0, atol=0.005)
    np.testing.assert_allclose(refined[3].T_guess, shifted(0.05), atol=1e-12)
