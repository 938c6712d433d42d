import numpy as np
import pytest
from clouds import motion
from poses import SECOND, odometry, pose_with_covariance, shifted, transform

from idem_ros.core import InvalidConfig, InvalidTransform
from idem_ros.core.geometry.se3 import exp
from idem_ros.messages.stamps import NotYet
from idem_ros.messages.transform_message import matrix_of
from idem_ros.pairing.guesses import GuessConfig, IdentityGuess
from idem_ros.pairing.stamped_poses import (
    KEPT,
    DoubtfulGuess,
    StampedPoses,
    interpolated,
    pose_at,
)
from idem_ros.pairing.streamed_guesses import FRAMES_KEPT, StreamedGuesses

CONFIG = GuessConfig()


def guesses_of(*messages):
    guesses = StreamedGuesses()
    for message in messages:
        guesses.add(message)
    return guesses


def pose_for(guesses, stamp, **config):
    return guesses.guess_for(stamp, 'map', 'lidar', GuessConfig(**config)).T_target_source


@pytest.mark.parametrize('make', [transform, pose_with_covariance, odometry])
def test_every_kind_of_message_gives_its_pose_bit_for_bit_at_its_own_stamp(rng, make):
    poses = [motion(rng, 30.0, 2.0) for _ in range(3)]
    messages = [make(SECOND + i, pose) for i, pose in enumerate(poses)]
    guesses = guesses_of(*messages)
    for i, message in enumerate(messages):
        np.testing.assert_array_equal(pose_for(guesses, SECOND + i), matrix_of(message))
        np.testing.assert_allclose(pose_for(guesses, SECOND + i), poses[i], atol=1e-12)


def test_a_guess_brings_the_frames_that_its_message_names():
    frames = {}
    for make in (transform, odometry):
        guess = guesses_of(make(5, frame='odom', child='base')).guess_for(5, '', '', CONFIG)
        frames[make] = (guess.target_frame, guess.source_frame)
    assert set(frames.values()) == {('odom', 'base')}
    guess = guesses_of(pose_with_covariance(5, frame='odom')).guess_for(5, '', '', CONFIG)
    assert (guess.target_frame, guess.source_frame) == ('odom', '')


@pytest.mark.parametrize('fraction', [0.0, 0.25, 0.5, 0.9, 1.0])
def test_between_two_poses_rotation_and_translation_go_at_constant_speed(rng, fraction):
    first = motion(rng, 40.0, 3.0)
    turn = exp(np.array([0.3, -0.2, 0.9, 0.0, 0.0, 0.0]))
    second = first @ turn
    second[:3, 3] += (1.0, -2.0, 0.5)
    pose = interpolated(first, second, fraction)
    part = exp(fraction * np.array([0.3, -0.2, 0.9, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(pose[:3, :3], (first @ part)[:3, :3], atol=1e-12)
    expected = first[:3, 3] + fraction * np.array([1.0, -2.0, 0.5])
    np.testing.assert_allclose(pose[:3, 3], expected, atol=1e-12)


def test_the_guess_is_interpolated_between_its_neighbours_in_time_in_any_order_of_arrival():
    messages = [transform(i * SECOND // 10, float(i)) for i in (4, 1, 3, 2)]
    pose = pose_for(guesses_of(*messages), 230_000_000)
    np.testing.assert_allclose(pose, shifted(2.3), atol=1e-12)


def test_of_guesses_with_one_stamp_the_last_received_is_taken():
    guesses = guesses_of(transform(7, 1.0), transform(7, 2.0))
    np.testing.assert_array_equal(pose_for(guesses, 7), shifted(2.0))


def test_after_the_newest_it_waits_and_says_how_old_that_is():
    with pytest.raises(NotYet, match='none'):
        pose_for(guesses_of(), 5)
    with pytest.raises(NotYet, match='2.5 s older'):
        pose_for(guesses_of(transform(SECOND, 1.0)), 3 * SECOND + SECOND // 2)


def test_before_the_first_that_one_holds_if_it_is_young_enough():
    guesses = guesses_of(transform(2 * SECOND, 4.0), transform(3 * SECOND, 5.0))
    np.testing.assert_array_equal(pose_for(guesses, 2 * SECOND - 10), shifted(4.0))
    with pytest.raises(DoubtfulGuess, match='1.5 s off; initial_guess.max_age is 1 s'):
        pose_for(guesses, SECOND // 2)


@pytest.mark.parametrize('stamp', [1_200_000_000, 2_800_000_000])
def test_neighbours_too_far_in_time_are_refused_rather_than_interpolated(stamp):
    guesses = guesses_of(transform(SECOND, 1.0), transform(3 * SECOND, 2.0))
    with pytest.raises(DoubtfulGuess, match='1.8 s off; initial_guess.max_age is 1 s'):
        pose_for(guesses, stamp)
    assert pose_for(guesses, stamp, max_age=1.8).shape == (4, 4)
    assert pose_for(guesses, stamp, max_age=None).shape == (4, 4)


def test_neighbours_that_jump_are_refused():
    guesses = guesses_of(transform(SECOND, 1.0), transform(SECOND + 10**8, 13.0))
    between = SECOND + 5 * 10**7
    with pytest.raises(DoubtfulGuess, match='jumps by 12 m within the 0.1 s .*max_jump is 10 m'):
        pose_for(guesses, between)
    np.testing.assert_allclose(pose_for(guesses, between, max_jump=None), shifted(7.0))
    np.testing.assert_array_equal(pose_for(guesses, SECOND), shifted(1.0))


def test_neighbours_between_different_frames_are_refused_by_name():
    guesses = guesses_of(transform(1, 0.0, 'map', 'lidar'), transform(3, 0.0, 'odom', 'lidar'))
    with pytest.raises(DoubtfulGuess, match="'lidar' in 'map' and 'lidar' in 'odom'"):
        guesses.guess_for(2, '', '', CONFIG)


def test_guesses_of_other_frames_are_none_for_a_source_and_named():
    guesses = guesses_of(transform(1, 1.0), transform(3, 9.0, '/odom', 'lidar'))
    np.testing.assert_array_equal(pose_for(guesses, 1), shifted(1.0))
    with pytest.raises(NotYet, match="do not count: 'lidar' in 'odom'") as waits:
        pose_for(guesses, 2)
    assert waits.value.is_doubtful
    guesses.add(transform(4, 4.0))
    np.testing.assert_allclose(pose_for(guesses, 2), shifted(2.0))
    found = guesses.guess_for(3, 'odom', '/lidar', CONFIG).T_target_source
    np.testing.assert_array_equal(found, shifted(9.0))


def test_a_flood_of_other_frames_and_stamps_takes_the_place_of_no_guess_that_serves():
    guesses = guesses_of(*(transform(i * SECOND, float(i)) for i in (100, 101)))
    pose_for(guesses, 100 * SECOND)
    for i in range(3 * FRAMES_KEPT * KEPT // 100):
        guesses.add(transform(101 * SECOND + i, 5.0, f'map{i}', 'lidar'))
    for i in range(KEPT - 2):
        guesses.add(transform(SECOND * (10_000 + i), 5.0))
    np.testing.assert_allclose(pose_for(guesses, 100 * SECOND + SECOND // 2), shifted(100.5))
    with pytest.raises(NotYet, match='s off; initial_guess.max_age is 1 s'):
        pose_for(guesses, 102 * SECOND)
    guesses.add(transform(102 * SECOND, 102.0))
    np.testing.assert_array_equal(pose_for(guesses, 102 * SECOND), shifted(102.0))


def test_a_neighbour_that_is_no_transform_is_refused():
    bad = transform(3, 1.0)
    bad.transform.rotation.w = 0.0
    with pytest.raises(InvalidTransform, match='quaternion'):
        pose_for(guesses_of(transform(1, 0.0), bad), 2)


def test_a_guess_without_stamp_serves_every_source_of_any_age_until_another_comes():
    guesses = guesses_of(transform(0, 3.0))
    for stamp in (5, 10**18, 0, 10**18 + 5):  # one of a driver that forgot it is no simulation
        np.testing.assert_array_equal(pose_for(guesses, stamp), shifted(3.0))
    guesses.add(transform(9, 4.0))
    np.testing.assert_array_equal(pose_for(guesses, 9), shifted(4.0))
    with pytest.raises(NotYet):
        pose_for(guesses, 10)


def test_the_oldest_guesses_are_forgotten():
    poses = StampedPoses()
    for stamp in range(KEPT + 3):
        poses.add(transform(stamp + 1))
    assert len(poses) == KEPT
    assert 3 not in poses
    assert 4 in poses


def test_what_is_later_than_a_stamp_can_be_forgotten():
    guesses = guesses_of(*(transform(stamp, float(stamp)) for stamp in (1, 5, 9)))
    guesses.forget_after(5)
    np.testing.assert_array_equal(pose_for(guesses, 5), shifted(5.0))
    with pytest.raises(NotYet):
        pose_for(guesses, 6)


def test_a_pose_in_a_rotation_that_stands_still_does_not_drift(rng):
    pose = motion(rng, 50.0, 1.0)
    messages = [transform(1, pose), transform(1001, pose)]
    for stamp in (2, 500, 1000):
        np.testing.assert_allclose(pose_at(stamp, messages, CONFIG), pose, atol=1e-14)


def test_the_identity_needs_no_message():
    guesses = IdentityGuess()
    guesses.forget_after(0)
    assert guesses
    found = guesses.guess_for(1, 'map', 'lidar', CONFIG).T_target_source
    np.testing.assert_array_equal(found, np.eye(4))


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        ({'type': 'pose'}, "initial_guess.type is 'pose'; it must be one of"),
        ({'max_age': 0.0}, 'initial_guess.max_age is 0.0'),
        ({'max_jump': float('nan')}, 'initial_guess.max_jump is nan'),
    ],
)
def test_a_value_out_of_range_is_refused_by_name(change, message):
    with pytest.raises(InvalidConfig, match=message):
        GuessConfig(**change)


def unsure(message, *variances):
    message.pose.covariance = np.diag(variances).ravel().tolist()
    return message


def test_a_guess_is_as_unsure_as_the_less_sure_of_its_neighbours():
    few, many = [0.01] * 6, [0.04] * 6
    guesses = guesses_of(
        unsure(odometry(SECOND, 0.0), *few), unsure(odometry(3 * SECOND, 1.0), *many)
    )
    for stamp, expected in ((SECOND, few), (2 * SECOND, many)):
        found = guesses.guess_for(stamp, 'map', 'lidar', GuessConfig(max_age=5.0)).covariance
        np.testing.assert_array_equal(found, np.diag(expected))


@pytest.mark.parametrize(
    'message',
    [
        transform(SECOND),
        pose_with_covariance(SECOND),  # zeros
        unsure(odometry(SECOND), -1.0, *[0.0] * 5),
    ],
)
def test_a_guess_without_a_covariance_says_nothing_of_how_sure_it_is(message):
    found = guesses_of(message).guess_for(SECOND, 'map', 'lidar', CONFIG)
    assert found.covariance is None
