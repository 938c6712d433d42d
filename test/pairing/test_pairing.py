import pytest
from pairs import LATER, LONG_AGO, cloud, guess, x_of
from poses import transform as guess_message

from idem_ros.pairing.pairing import SOURCES_KEPT, Pairing
from idem_ros.pairing.stamped_poses import KEPT as GUESSES_KEPT


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


def test_where_a_source_has_stamp_zero_it_is_a_time_and_no_guess_serves_the_next(pairing):
    pairing.add_target(cloud(0))
    assert pairing.add_source(cloud(0)) == []
    assert [x_of(pair) for pair in pairing.add_guess(guess_message(0, 7.0))] == [7.0]
    assert pairing.add_source(cloud(4)) == []
    assert [x_of(pair) for pair in pairing.add_guess(guess_message(4, 8.0))] == [8.0]


def test_a_guess_of_stamp_zero_is_a_time_from_the_source_of_that_stamp_on(pairing):
    pairing.add_target(cloud(0))
    pairing.add_guess(guess_message(0, 7.0))
    (first,) = pairing.add_source(cloud(0))
    assert (x_of(first), first.guess.is_timeless) == (7.0, False)
    assert pairing.add_source(cloud(4)) == []


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
    assert (pairing.refused, pairing.waiting) == (0, 1)  # until another source has come
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
