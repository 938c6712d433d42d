from types import SimpleNamespace as Record

import pytest

from idem_ros.pairing import CLOUDS_KEPT, GUESSES_KEPT, Pairing


def cloud(stamp, frame=''):
    return Record(header=_header(stamp, frame))


def guess(stamp, frame='', child=''):
    return Record(header=_header(stamp, frame), child_frame_id=child)


def _header(stamp, frame):
    seconds, nanoseconds = divmod(stamp, 10**9)
    return Record(stamp=Record(sec=seconds, nanosec=nanoseconds), frame_id=frame)


@pytest.fixture
def pairing():
    return Pairing()


def test_a_pair_is_complete_with_a_target_a_source_and_the_guess_of_its_stamp(pairing):
    target, source, its_guess = cloud(1), cloud(2), guess(2)
    assert pairing.add_target(target) == []
    assert pairing.add_source(source) == []
    (pair,) = pairing.add_guess(its_guess)
    assert (pair.target, pair.source, pair.guess) == (target, source, its_guess)
    assert pair.stamp == 2


@pytest.mark.parametrize('order', ['tsg', 'tgs', 'stg', 'sgt', 'gts', 'gst'])
def test_the_order_of_arrival_does_not_matter(pairing, order):
    inputs = {
        't': (pairing.add_target, cloud(10)),
        's': (pairing.add_source, cloud(11)),
        'g': (pairing.add_guess, guess(11)),
    }
    pairs = [pair for letter in order for pair in inputs[letter][0](inputs[letter][1])]
    assert [(p.target, p.source, p.guess) for p in pairs] == [
        tuple(inputs[letter][1] for letter in 'tsg')
    ]


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


def test_without_its_own_the_nearest_guess_is_taken_once_a_later_one_has_come(pairing):
    pairing.add_target(cloud(1))
    pairing.add_source(cloud(100))
    assert pairing.add_guess(guess(90)) == []
    assert pairing.add_guess(guess(98)) == []
    (pair,) = pairing.add_guess(guess(103))
    assert pair.guess.header.stamp.nanosec == 98


def test_the_guess_of_its_own_stamp_goes_before_a_timeless_one(pairing):
    pairing.add_target(cloud(1))
    own = guess(2)
    pairing.add_guess(own)
    pairing.add_guess(guess(0))
    (pair,) = pairing.add_source(cloud(2))
    assert pair.guess is own


def test_a_timeless_guess_serves_every_source_until_another_comes(pairing):
    pairing.add_target(cloud(1))
    timeless = guess(0)
    pairing.add_guess(timeless)
    for stamp in (2, 3):
        (pair,) = pairing.add_source(cloud(stamp))
        assert pair.guess is timeless
    replaced = guess(0)
    pairing.add_guess(replaced)
    assert pairing.add_source(cloud(4))[0].guess is replaced
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
    for stamp in range(1, CLOUDS_KEPT + 4):
        pairing.add_source(cloud(stamp))
    assert pairing.dropped == 3
    assert pairing.waiting == CLOUDS_KEPT
    pairing.add_guess(guess(0))
    assert [pair.stamp for pair in pairing.add_target(cloud(0))][0] == 4


def test_a_source_that_is_complete_at_once_drops_none_that_waits(pairing):
    pairing.add_target(cloud(1))
    for stamp in range(10, 10 + CLOUDS_KEPT):
        pairing.add_source(cloud(stamp))
    pairing.add_guess(guess(5))
    assert len(pairing.add_source(cloud(5))) == 1
    assert pairing.dropped == 0


def test_old_guesses_are_forgotten(pairing):
    pairing.add_target(cloud(1))
    for stamp in range(1, GUESSES_KEPT + 2):
        pairing.add_guess(guess(stamp))
    (pair,) = pairing.add_source(cloud(1))
    assert pair.guess.header.stamp.nanosec == 2


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
    assert len(pairing.take_refusals()) == CLOUDS_KEPT


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


def test_a_recording_in_a_loop_does_not_use_guesses_of_the_pass_before(pairing):
    pairing.add_target(cloud(1))
    for stamp in (10, 20, 30):
        pairing.add_guess(guess(stamp))
        assert len(pairing.add_source(cloud(stamp))) == 1
    assert pairing.add_source(cloud(9)) == []
    again = guess(9)
    (pair,) = pairing.add_guess(again)
    assert pair.guess is again


def test_a_guess_that_goes_back_in_time_ends_the_pass_before(pairing):
    pairing.add_target(cloud(1))
    pairing.add_guess(guess(30))
    pairing.add_guess(guess(8))
    assert pairing.add_source(cloud(9)) == []
    (pair,) = pairing.add_guess(guess(12))
    assert pair.guess.header.stamp.nanosec == 8
