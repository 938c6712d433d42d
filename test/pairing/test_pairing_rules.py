"""Rules that a user chooses for pairing, and what becomes of pairs as clocks are set back."""

import numpy as np
import pytest
from pairs import LATER, LONG_AGO, cloud, guess, x_of
from poses import SECOND, odometry, pose_with_covariance, tf
from poses import transform as guess_message

from idem_ros.core import InvalidConfig
from idem_ros.messages.stamps import DISORDER
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.pairing import Pairing
from idem_ros.pairing.targets import PairingConfig


@pytest.fixture
def pairing():
    return Pairing()


def test_limits_may_change_while_it_runs(pairing):
    pairing.add_target(cloud(1))
    pairing.add_guess(guess_message(LONG_AGO, 0.0))
    pairing.add_guess(guess_message(LATER, 2.0))
    assert pairing.add_source(cloud(LONG_AGO + 5 * SECOND)) == []
    pairing.configure(PairingConfig(), GuessConfig(max_age=None))
    (pair,) = pairing.add_source(cloud(LONG_AGO + 5 * SECOND))
    assert x_of(pair) == pytest.approx(0.5)


@pytest.mark.parametrize(('kind', 'expected'), [('identity', np.eye(4)), ('last', None)])
def test_a_guess_that_no_message_gives_is_not_waited_for(kind, expected):
    pairing = Pairing(guess_config=GuessConfig(type=kind))
    assert pairing.waiting_for() == 'target and source'
    pairing.add_target(cloud(1))
    (pair,) = pairing.add_source(cloud(5))
    np.testing.assert_array_equal(pair.guess.T_target_source, expected)


def test_odometry_of_another_frame_is_refused_by_name():
    pairing = Pairing(guess_config=GuessConfig(type='odometry'))
    pairing.add_target(cloud(1, 'map'))
    pairing.add_guess(odometry(5, 1.0, 'map', 'lidar'))
    pairing.add_guess(odometry(7, 1.0, 'odom', 'base'))
    assert len(pairing.add_source(cloud(5, 'lidar'))) == 1
    assert pairing.add_source(cloud(7, 'lidar')) == []
    assert "those of other frames do not count: 'base' in 'odom'" in pairing.why_it_waits()
    pairing.add_source(cloud(8, 'lidar'))
    (refusal,) = pairing.take_refusals()
    assert (refusal.stamp, pairing.waiting) == (7, 1)


def test_odometry_of_another_frame_alone_is_refused_by_name():
    pairing = Pairing(guess_config=GuessConfig(type='odometry'))
    pairing.add_target(cloud(1, 'map'))
    pairing.add_guess(odometry(7, 1.0, 'odom', 'base'))
    assert pairing.add_source(cloud(7, 'lidar')) == []
    (refusal,) = pairing.take_refusals()
    assert "frame_id 'odom', but the target cloud is in frame 'map'" in refusal.reason


def test_a_timeless_guess_that_is_none_is_refused_and_the_one_before_serves_on(pairing):
    pairing.add_target(cloud(1))
    pairing.add_guess(guess_message(0, 3.0))
    bad = guess_message(0, 4.0)
    bad.transform.translation.x = np.nan
    pairing.add_guess(bad)
    (pair,) = pairing.add_source(cloud(LATER))
    assert x_of(pair) == 3.0
    (refusal,) = pairing.take_refusals()
    assert refusal.reason.startswith('initial guess: the transform is not finite')


def test_a_static_transform_that_is_none_displaces_none_that_is():
    pairing = tf_pairing()
    pairing.add_static_transforms(tf(guess_message(0, 0.5, 'map', 'lidar')))
    bad = guess_message(0, 1.0, 'map', 'lidar')
    bad.transform.rotation.w = 0.0
    pairing.add_static_transforms(tf(bad, guess_message(0, 0.0, 'map', 'odom')))
    (pair,) = pairing.add_source(cloud(LATER, 'lidar'))
    assert x_of(pair) == 0.5
    (refusal,) = pairing.take_refusals()
    assert refusal.reason.startswith("initial guess: 'lidar' in /tf_static: the quaternion")


def test_a_single_pose_of_a_stream_waits_and_names_the_type_it_would_suffice_for():
    pairing = Pairing(guess_config=GuessConfig('pose_with_covariance'))
    pairing.add_target(cloud(1))
    pairing.add_guess(pose_with_covariance(LONG_AGO, 1.0, 'map'))
    assert pairing.add_source(cloud(LATER)) == []
    assert 'initial_guess.type initial_pose' in pairing.why_it_waits()
    pairing.add_guess(pose_with_covariance(LONG_AGO + 5, 1.0, 'map'))
    assert 'initial_pose' not in pairing.why_it_waits()


def tf_pairing():
    pairing = Pairing(guess_config=GuessConfig(type='tf'))
    pairing.add_target(cloud(1, 'map'))
    return pairing


def test_the_guess_from_tf_is_that_at_the_stamp_of_the_source():
    pairing = tf_pairing()
    assert pairing.add_source(cloud(150, 'lidar')) == []
    assert pairing.why_it_waits().startswith('initial guess: tf does not connect the source frame')
    pairing.add_static_transforms(tf(guess_message(0, 0.5, 'base', 'lidar')))
    assert pairing.add_guess(tf(guess_message(100, 1.0, 'map', 'base'))) == []
    assert pairing.waiting_for() == 'initial_guess'
    (pair,) = pairing.add_guess(tf(guess_message(200, 2.0, 'map', 'base')))
    assert x_of(pair) == pytest.approx(2.0)


def test_a_transform_that_is_missing_refuses_the_source_once_another_has_come():
    pairing = tf_pairing()
    pairing.add_guess(tf(guess_message(100, 0.0, 'odom', 'base')))
    pairing.add_source(cloud(100, 'lidar'))
    assert pairing.take_refusals() == []
    pairing.add_source(cloud(200, 'lidar'))
    (refusal,) = pairing.take_refusals()
    assert refusal.stamp == 100
    assert "'lidar' with the target frame 'map'" in refusal.reason
    assert (pairing.refused, pairing.waiting) == (1, 1)


def test_nearest_takes_the_target_nearest_in_time_once_none_nearer_can_come():
    pairing = Pairing(PairingConfig('nearest'), GuessConfig('identity'))
    step = SECOND // 10
    pairing.add_target(cloud(LATER))
    assert pairing.add_source(cloud(LATER + step // 5)) == []
    assert pairing.why_it_waits() == 'target: the newest is 0.02 s older than the source'
    assert pairing.waiting_for() == 'target'
    (pair,) = pairing.add_target(cloud(LATER + step))
    assert stamp_ns(pair.target) == LATER
    (pair,) = pairing.add_source(cloud(LATER + step))
    assert stamp_ns(pair.target) == LATER + step


def test_nearest_refuses_a_source_that_no_target_is_near():
    pairing = Pairing(PairingConfig('nearest', 0.05), GuessConfig('identity'))
    pairing.add_target(cloud(LATER))
    pairing.add_source(cloud(LATER + SECOND))
    assert pairing.add_target(cloud(LATER + 2 * SECOND)) == []
    (refusal,) = pairing.take_refusals()
    assert refusal.reason == (
        'target: the nearest target is 1 s off the source; pairing_tolerance is 0.05 s'
    )
    pairing.configure(PairingConfig('nearest', 1.0), GuessConfig('identity'))
    assert len(pairing.add_source(cloud(LATER + SECOND))) == 1


def test_newest_takes_the_newest_target_whatever_the_stamp_of_the_source():
    pairing = Pairing(PairingConfig('newest'), GuessConfig('identity'))
    for stamp in (5, 9, 7):
        pairing.add_target(cloud(stamp))
    (pair,) = pairing.add_source(cloud(6))
    assert stamp_ns(pair.target) == 9
    last = cloud(9)
    pairing.add_target(last)
    assert pairing.add_source(cloud(6))[0].target is last


def test_sources_and_guesses_out_of_order_or_repeated_are_each_served(pairing):
    pairing.add_target(cloud(1))
    stamps = [LATER + i * SECOND // 10 for i in (0, 2, 1, 1, 3)]
    served = []
    for stamp in stamps:
        pairing.add_guess(guess_message(stamp, stamp / SECOND))
        served += pairing.add_source(cloud(stamp))
    assert [pair.stamp for pair in served] == stamps
    assert [x_of(pair) for pair in served] == [stamp / SECOND for stamp in stamps]
    assert pairing.jumps == 0
    late = pairing.add_source(cloud(LATER + SECOND // 20))
    assert x_of(late[0]) == pytest.approx(LATER / SECOND + 0.05)


def test_a_recording_in_a_loop_does_not_use_guesses_of_the_pass_before(pairing):
    pairing.add_target(cloud(1))
    for stamp in (LATER, LATER + SECOND):
        pairing.add_guess(guess(stamp))
        assert len(pairing.add_source(cloud(stamp))) == 1
    assert pairing.add_source(cloud(LONG_AGO)) == []
    assert (pairing.jumps, pairing.last_jump) == (1, 21 * SECOND)
    (pair,) = pairing.add_guess(guess_message(LONG_AGO, 3.0))
    assert (x_of(pair), pair.jumps) == (3.0, 1)
    assert pairing.jumps == 1


def test_a_guess_that_goes_back_in_time_ends_the_pass_before(pairing):
    pairing.add_target(cloud(1))
    pairing.add_source(cloud(LATER + 5))
    pairing.add_guess(guess(LATER))
    pairing.add_guess(guess_message(LONG_AGO, 0.0))
    assert (pairing.jumps, pairing.waiting, pairing.dropped) == (1, 0, 1)
    assert pairing.add_source(cloud(LONG_AGO + 5)) == []
    (pair,) = pairing.add_guess(guess_message(LONG_AGO + 10, 1.0))
    assert x_of(pair) == pytest.approx(0.5)
    assert pairing.jumps == 1


def test_the_nodes_clock_that_goes_back_ends_the_pass_before_and_keeps_what_is_of_the_new(pairing):
    pairing.add_target(cloud(LONG_AGO))
    pairing.add_guess(guess(LATER))
    pairing.add_source(cloud(LATER + 5))
    pairing.clock_goes_back(LATER - DISORDER // 2)
    assert (pairing.jumps, pairing.waiting) == (0, 1)
    pairing.clock_goes_back(LONG_AGO)
    assert (pairing.jumps, pairing.waiting, pairing.dropped) == (1, 0, 1)
    pairing.add_source(cloud(LONG_AGO + 7))
    pairing.clock_goes_back(LONG_AGO)
    assert (pairing.jumps, pairing.waiting) == (1, 1)
    assert len(pairing.add_guess(guess(LONG_AGO + 7))) == 1


@pytest.mark.parametrize(
    ('rule', 'kept'), [('latched', True), ('newest', True), ('nearest', False)]
)
def test_a_map_outlives_a_clock_that_goes_back(rule, kept):
    pairing = Pairing(PairingConfig(rule, 100.0), GuessConfig('identity'))
    for stamp in (LATER, LATER + SECOND):
        pairing.add_target(cloud(stamp))
    assert len(pairing.add_source(cloud(LATER))) == 1
    pairs = pairing.add_source(cloud(LONG_AGO))
    assert [stamp_ns(pair.target) for pair in pairs] == [LATER + SECOND] * kept
    assert pairing.jumps == 1


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        ({'pairing': 'next'}, "pairing is 'next'; it must be one of"),
        ({'pairing_tolerance': -1.0}, 'pairing_tolerance is -1.0'),
    ],
)
def test_a_value_out_of_range_is_refused_by_name(change, message):
    with pytest.raises(InvalidConfig, match=message):
        PairingConfig(**change)


def test_guesses_of_another_type_begin_anew_and_sources_wait_for_them(pairing):
    pairing.add_target(cloud(1))
    pairing.add_guess(guess(0))
    pairing.configure(PairingConfig(), GuessConfig(type='odometry'))
    assert pairing.add_source(cloud(2)) == []
    (pair,) = pairing.add_guess(odometry(2, 5.0))
    assert x_of(pair) == 5.0


def test_guesses_of_the_same_type_stay_when_their_limits_change(pairing):
    pairing.add_target(cloud(1))
    pairing.add_guess(guess(2))
    pairing.configure(PairingConfig(), GuessConfig(max_age=3.0))
    assert len(pairing.add_source(cloud(2))) == 1


def test_dropped_sources_are_counted_and_targets_and_guesses_stay(pairing):
    pairing.add_target(cloud(1))
    for stamp in (2, 3):
        pairing.add_source(cloud(stamp))
    pairing.drop_sources()
    assert (pairing.waiting, pairing.dropped) == (0, 2)
    pairing.add_guess(guess(4))
    assert len(pairing.add_source(cloud(4))) == 1


def test_pairing_that_begins_anew_waits_for_everything_and_keeps_its_counts(pairing):
    pairing.add_target(cloud(LATER))
    pairing.add_guess(guess(LATER))
    pairing.add_source(cloud(LATER + 1))
    pairing.forget()
    assert pairing.waiting_for() == 'target and source and initial_guess'
    assert (pairing.dropped, pairing.why_it_waits()) == (1, '')
    pairing.add_target(cloud(LONG_AGO))
    pairing.add_guess(guess(LONG_AGO))
    assert len(pairing.add_source(cloud(LONG_AGO))) == 1
    assert pairing.jumps == 0
