import numpy as np
import pytest
from poses import odometry, transform
from sweeps import FRAMES, PERIOD, START, driven, map_message, sweep_message

from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.pairing import Pairing
from idem_ros.refinement.point_time_config import PointTimeConfig

STAMP = START + PERIOD


@pytest.fixture
def pairing(rng):
    """One whose sources wait for a guess at the end of their sweep."""
    pairing = Pairing(guess_config=GuessConfig(type='odometry'))
    pairing.sweeps.configure(PointTimeConfig())
    pairing.add_target(map_message(rng))
    pairing.add_guess(guess(STAMP))
    return pairing


def guess(stamp):
    return odometry(stamp, driven((stamp - START) / 1e9), *FRAMES)


def test_a_source_waits_for_a_guess_at_the_end_of_its_sweep(pairing, rng):
    assert pairing.add_source(sweep_message(rng, driven, STAMP)) == []
    assert 'older than the end of the sweep' in pairing.why_it_waits()
    assert pairing.add_guess(guess(STAMP + PERIOD // 2)) == []
    (pair,) = pairing.add_guess(guess(STAMP + PERIOD))
    stamps, _ = pair.guess.trail.poses_over(STAMP, STAMP + PERIOD)
    np.testing.assert_array_equal(stamps, [STAMP, STAMP + PERIOD // 2, STAMP + PERIOD])


def test_a_source_waits_no_longer_where_the_second_after_it_comes(pairing, rng):
    first, second, third = (sweep_message(rng, driven, STAMP + k * PERIOD) for k in range(3))
    pairing.add_guess(guess(STAMP + 1))  # for the first alone there is a motion
    assert pairing.add_source(first) == []
    assert pairing.add_source(second) == []
    (pair,) = pairing.add_source(third)
    assert pair.source is first


def test_a_guess_that_comes_with_the_next_source_is_waited_for(pairing, rng):
    pairing.add_source(sweep_message(rng, driven, STAMP))
    pairing.add_source(sweep_message(rng, driven, STAMP + PERIOD))
    (pair,) = pairing.add_guess(guess(STAMP + PERIOD))
    assert pair.stamp == STAMP


def test_the_last_source_is_there_for_who_knows_that_no_guess_will_come(pairing, rng):
    pairing.add_source(sweep_message(rng, driven, STAMP))
    pairing.sweeps.configure(None)
    assert len(pairing.complete()) == 1


@pytest.mark.parametrize('sweep', [{'begin': -0.1}, {'timed': False}])
def test_a_source_that_ends_at_its_stamp_or_has_no_times_does_not_wait(pairing, rng, sweep):
    assert len(pairing.add_source(sweep_message(rng, driven, STAMP, **sweep))) == 1


def test_a_guess_for_any_stamp_is_not_waited_for(rng):
    pairing = Pairing()
    pairing.sweeps.configure(PointTimeConfig())
    pairing.add_target(map_message(rng))
    pairing.add_guess(transform(0, None, *FRAMES))
    assert len(pairing.add_source(sweep_message(rng, driven, STAMP))) == 1
