from types import SimpleNamespace as Record

import numpy as np
import pytest
from poses import SECOND, header, odometry, tf
from poses import transform as guess_message

from idem_ros.core import InvalidConfig
from idem_ros.guesses import KEPT as GUESSES_KEPT
from idem_ros.guesses import GuessConfig
from idem_ros.pairing import SOURCES_KEPT, Pairing
from idem_ros.stamps import DISORDER
from idem_ros.targets import PairingConfig
from idem_ros.transform_message import stamp_ns

LONG_AGO = 100 * SECOND
LATER = LONG_AGO + 20 * SECOND


def cloud(stamp, frame=''):
    return Record(header=header(stamp, frame))


def guess(stamp, frame='', child=''):
    """A guess whose x tells its stamp [ns]."""
    return guess_message(stamp, float(stamp), frame, child)


def x_of(pair):
    return pair.guess.T_target_source[0, 3]


@pytest.fixture
def pairing():
    return Pairing()


def test_a_pair_is_complete_with_a_target_a_source_and_the_guess_of_its_stamp(pairing):
    target, source = cloud(1), cloud(2)
    assert pairing.add_target(target) == []
    assert pairing.add_source(source) == []
    (pair,) = pairing.add_guess(guess(2))
    assert (pair.target, pair.source) == (target, source)
    assert (pair.stamp, x_of(pair)) == (2, 2.0)


@pytest.mark.parametrize('order', ['tsg', 'tgs', 'stg', 'sgt', 'gts', 'gst'])
def test_the_order_of_arrival_does_not_matter(pairing, order):
    inputs = {
        't': (pairing.add_target, cloud(10)),
        's': (pairing.add_source, cloud(11)),
        'g': (pairing.add_guess, guess(11)),
    }
    pairs = [pair for letter in order for pair in inputs[letter][0](inputs[letter][1])]
    (pair,) = pairs
    assert (pair.target, pair.source) == tuple(inputs[letter][1] for letter in 'ts')
    assert x_of(pair) == 11.0


def test_a_source_is_used_once(pairing):
    pairing.add_target(cloud(1))
    pairing.add_source(cloud(2))
    assert len(pairing.add_guess(guess(2))) == 1
    assert pairing.add_guess(guess(2)) == []
    assert pairing.add_target(cloud(2)) == []


def test_the_target_is_the_newest_that_is_not_later_than_the_source(pairing):
    for stamp in (1, 5, 3, 9):
        pairing.add_target(cloud(stamp))
    pairing.add_guess(guess(0))
    (pair,) = pairing.add_source(cloud(6))
    assert pair.target.header.stamp.nanosec == 5


def test_a_target_may_have_the_stamp_of_the_source(pairing):
    for stamp in (5, 6, 7):
        pairing.add_target(cloud(stamp))
    pairing.add_guess(guess(0))
    (pair,) = pairing.add_source(cloud(6))
    assert pair.target.header.stamp.nanosec == 6


def test_of_targets_with_the_same_stamp_the_last_received_is_taken(pairing):
    pairing.add_target(cloud(0))
    last = cloud(0)
    pairing.add_target(last)
    pairing.add_guess(guess(0))
    (pair,) = pairing.add_source(cloud(0))
    assert pair.target is last


def test_a_latched_map_may_bear_any_stamp(pairing):
    pairing.add_target(cloud(100))
    last = cloud(50)
    pairing.add_target(last)
    pairing.add_guess(guess(7))
    (pair,) = pairing.add_source(cloud(7))
    assert pair.target is last


def test_without_its_own_the_guess_is_interpolated_once_a_later_one_has_come(pairing):
    pairing.add_target(cloud(1))
    pairing.add_source(cloud(100))
    assert pairing.add_guess(guess(90)) == []
    assert pairing.add_guess(guess(98)) == []
    (pair,) = pairing.add_guess(guess(103))
    assert x_of(pair) == pytest.approx(100.0)


def test_the_guess_of_its_own_stamp_goes_before_a_timeless_one(pairing):
    pairing.add_target(cloud(1))
    pairing.add_guess(guess(2))
    pairing.add_guess(guess(0))
    (pair,) = pairing.add_source(cloud(2))
    assert x_of(pair) == 2.0


def test_a_timeless_guess_serves_every_source_until_another_comes(pairing):
    pairing.add_target(cloud(1))
    pairing.add_guess(guess_message(0, 7.0))
    assert [x_of(pairing.add_source(cloud(stamp))[0]) for stamp in (2, 3)] == [7.0, 7.0]
    pairing.add_guess(guess_message(0, 8.0))
    assert x_of(pairing.add_source(cloud(4))[0]) == 8.0
    pairing.add_guess(guess(4))
    assert pairing.add_source(cloud(5)) == []


def test_sources_of_stamp_zero_are_each_their_own(pairing):
    pairing.add_target(cloud(0))
    pairing.add_guess(guess(0))
    assert [len(pairing.add_source(cloud(0))) for _ in range(3)] == [1, 1, 1]


def test_a_target_that_comes_last_completes_every_waiting_source(pairing):
    pairing.add_guess(guess(0))
    pairing.add_source(cloud(2))
    pairing.add_source(cloud(3))
    assert [pair.stamp for pair in pairing.add_target(cloud(9))] == [2, 3]


def test_sources_that_fall_out_of_the_buffer_are_counted(pairing):
    for stamp in range(1, SOURCES_KEPT + 4):
        pairing.add_source(cloud(stamp))
    assert pairing.dropped == 3
    assert pairing.waiting == SOURCES_KEPT
    pairing.add_guess(guess(0))
    assert [pair.stamp for pair in pairing.add_target(cloud(0))][0] == 4


def test_a_source_that_is_complete_at_once_drops_none_that_waits(pairing):
    pairing.add_target(cloud(1))
    for stamp in range(10, 10 + SOURCES_KEPT):
        pairing.add_source(cloud(stamp))
    pairing.add_guess(guess(5))
    assert len(pairing.add_source(cloud(5))) == 1
    assert pairing.dropped == 0


def test_old_guesses_are_forgotten(pairing):
    pairing.add_target(cloud(1))
    for stamp in range(1, GUESSES_KEPT + 2):
        pairing.add_guess(guess(stamp))
    (pair,) = pairing.add_source(cloud(1))
    assert x_of(pair) == 2.0


@pytest.mark.parametrize(
    ('bad_guess', 'words'),
    [
        (guess(2, 'odom', 'lidar'), ["frame_id 'odom'", 'target', "'map'"]),
        (guess(2, 'map', 'base'), ["child_frame_id 'base'", 'source', "'lidar'"]),
    ],
)
def test_frames_that_contradict_are_refused_with_both_names(pairing, bad_guess, words):
    pairing.add_target(cloud(1, 'map'))
    pairing.add_source(cloud(2, 'lidar'))
    assert pairing.add_guess(bad_guess) == []
    (refusal,) = pairing.take_refusals()
    assert refusal.stamp == 2
    assert all(word in refusal.reason for word in words)
    assert (pairing.refused, pairing.waiting) == (1, 0)
    assert pairing.take_refusals() == []


@pytest.mark.parametrize(
    ('target', 'source', 'frame', 'child'),
    [('map', 'lidar', '', ''), ('', '', 'map', 'lidar'), ('/map', 'lidar', 'map', '/lidar')],
)
def test_frames_that_are_empty_or_differ_by_a_slash_contradict_nothing(
    pairing, target, source, frame, child
):
    pairing.add_target(cloud(1, target))
    pairing.add_guess(guess(2, frame, child))
    assert len(pairing.add_source(cloud(2, source))) == 1


def test_refusals_that_nobody_takes_do_not_pile_up(pairing):
    pairing.add_target(cloud(1, 'map'))
    pairing.add_guess(guess(0, 'odom'))
    for stamp in range(2, 102):
        pairing.add_source(cloud(stamp))
    assert pairing.refused == 100
    assert len(pairing.take_refusals()) == SOURCES_KEPT


def test_it_says_what_it_waits_for(pairing):
    assert pairing.waiting_for() == 'target and source and initial_guess'
    pairing.add_source(cloud(5))
    assert pairing.waiting_for() == 'target and initial_guess'
    pairing.add_target(cloud(1))
    assert pairing.waiting_for() == 'initial_guess'
    pairing.add_guess(guess(5))
    assert pairing.waiting_for() == 'source'


def test_it_does_not_wait_for_a_guess_that_is_there(pairing):
    pairing.add_guess(guess(5))
    pairing.add_source(cloud(5))
    assert pairing.waiting_for() == 'target'


def test_a_source_without_a_usable_guess_is_refused_with_the_reason(pairing):
    pairing.add_target(cloud(1))
    pairing.add_source(cloud(LONG_AGO))
    assert pairing.add_guess(guess_message(LONG_AGO - 10, 0.0)) == []
    assert pairing.add_guess(guess_message(LATER, 0.0)) == []
    bad = guess_message(LATER + 1)
    bad.transform.rotation.w = 0.0
    pairing.add_source(cloud(LATER + 1))
    assert pairing.add_guess(bad) == []
    first, second = pairing.take_refusals()
    assert first.reason.startswith('initial guess: the nearest before or after the source is 20 s')
    assert second.reason.startswith('initial guess: the quaternion')
    assert (first.stamp, second.stamp) == (LONG_AGO, LATER + 1)
    assert (pairing.refused, pairing.waiting) == (2, 0)


def test_a_source_that_waits_says_for_what(pairing):
    assert pairing.why_it_waits() == ''
    pairing.add_source(cloud(LATER))
    assert pairing.why_it_waits() == 'target: none has come'
    pairing.add_target(cloud(1))
    assert pairing.why_it_waits() == 'initial guess: none has come'
    pairing.add_guess(guess(LONG_AGO))
    assert pairing.why_it_waits() == 'initial guess: the newest is 20 s older than the source'
    pairing.add_guess(guess(LATER))
    assert pairing.why_it_waits() == ''


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
    (refusal,) = pairing.take_refusals()
    assert "frame_id 'odom', but the target cloud is in frame 'map'" in refusal.reason


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
