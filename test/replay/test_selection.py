import pytest

from idem_ros.core import InvalidConfig
from idem_ros.replay.run import Selection
from idem_ros.replay.settings import Settings

BEGIN, SECOND = 5 * 10**18, 10**9


def taken(count=10, **settings):
    """Return which of some sources, one a second, are taken."""
    selection = Selection(Settings(**settings), BEGIN)
    found = [i for i in range(count) if selection.takes(BEGIN + i * SECOND)]
    assert selection.left_out == count - len(found)
    return found


def test_by_default_all_are_taken_and_nothing_is_noted():
    assert taken() == list(range(10))
    assert Selection(Settings(), BEGIN).notes() == []


def test_a_span_of_time_begins_with_its_start_and_ends_before_its_end():
    assert taken(start=3.0) == [3, 4, 5, 6, 7, 8, 9]
    assert taken(duration=3.0) == [0, 1, 2]
    assert taken(start=2.5, duration=2.0) == [3, 4]
    assert taken(start=99.0) == []


def test_every_nth_is_counted_from_the_first_of_the_span():
    assert taken(every=4) == [0, 4, 8]
    assert taken(start=3.0, every=3) == [3, 6, 9]


def test_the_end_is_known_by_the_clock_of_the_recording():
    selection = Selection(Settings(start=1.0, duration=2.0), BEGIN)
    seconds = (0.0, 1.0, 2.9, 3.0)
    over = [selection.is_over(BEGIN + round(s * SECOND)) for s in seconds]
    assert over == [False, False, False, True]


def test_what_is_left_out_is_noted():
    selection = Selection(Settings(start=1.0, duration=2.0, every=2), BEGIN)
    for i in range(5):
        selection.takes(BEGIN + i * SECOND)
    assert selection.notes() == ['4 sources left out: one in 2 is taken, from 1 s on for 2 s']


@pytest.mark.parametrize(
    ('settings', 'words'),
    [
        ({'start': -1.0}, 'start is -1'),
        ({'start': float('nan')}, 'start is nan'),
        ({'duration': 0.0}, 'duration is 0'),
        ({'every': 0}, 'every is 0'),
        ({'every': 1.5}, 'every is 1.5'),
    ],
)
def test_what_is_no_span_is_refused(settings, words):
    with pytest.raises(InvalidConfig, match=words):
        Settings(**settings)
