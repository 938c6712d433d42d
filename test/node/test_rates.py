import threading

import pytest

from idem_ros.node.traffic import MOST, RecentValues, Utilisation


def test_rate_is_that_of_the_last_span():
    recent = RecentValues(start=0.0, span=5.0)
    for i in range(100):
        recent.add(i * 0.1)
    assert recent.rate(9.95) == pytest.approx(10.0)
    assert recent.rate(12.4) == pytest.approx(5.0)
    assert recent.rate(15.0) == 0.0


def test_rate_of_the_first_seconds_is_over_these():
    recent = RecentValues(start=100.0, span=5.0)
    for i in range(20):
        recent.add(100.0 + i * 0.1)
    assert recent.rate(102.0) == pytest.approx(10.0)


def test_one_event_at_the_start_is_not_taken_for_a_storm():
    recent = RecentValues(start=0.0)
    recent.add(0.001)
    assert recent.rate(0.002) == 1.0


def test_what_came_at_once_counts_as_often_as_it_came():
    recent = RecentValues(start=0.0, span=5.0)
    for i in range(10):
        recent.add(float(i), count=1000)
    assert recent.rate(9.5) == pytest.approx(1000.0)


def test_values_older_than_the_span_are_forgotten():
    recent = RecentValues(start=0.0, span=5.0)
    for now, value in ((0.0, 1.0), (3.0, 2.0), (6.0, 3.0)):
        recent.add(now, value)
    assert recent.values(6.0) == [2.0, 3.0]
    assert recent.values(20.0) == []


def test_memory_is_bounded_however_many_come():
    recent = RecentValues(start=0.0)
    for _ in range(MOST + 10):
        recent.add(1.0)
    assert len(recent.values(1.0)) == MOST


def test_utilisation_is_the_share_of_the_span_that_was_work():
    busy = Utilisation(start=0.0, span=5.0)
    for begin in range(10):
        busy.begin(float(begin))
        busy.end(begin + 0.25)
    assert busy.share(10.0) == pytest.approx(0.25)
    assert busy.share(30.0) == 0.0


def test_work_under_way_counts_as_far_as_it_has_come():
    busy = Utilisation(start=0.0, span=5.0)
    busy.begin(8.0)
    assert busy.share(10.0) == pytest.approx(0.4)
    assert busy.share(20.0) == 1.0
    busy.end(20.0)
    assert busy.share(22.0) == pytest.approx(0.6)


def test_utilisation_of_the_first_second_is_over_that():
    busy = Utilisation(start=100.0)
    assert busy.share(100.0) == 0.0
    busy.begin(100.0)
    busy.end(100.5)
    assert busy.share(101.0) == pytest.approx(0.5)


def test_end_without_a_begin_counts_nothing():
    busy = Utilisation(start=0.0)
    busy.end(3.0)
    assert busy.share(4.0) == 0.0


def test_threads_may_add_while_another_reads():
    recent = RecentValues(start=0.0, span=1e-3)
    errors = []

    def add():
        try:
            for i in range(5000):
                recent.add(i * 1e-5)
                recent.rate(i * 1e-5)
        except RuntimeError as error:  # deque mutated during iteration
            errors.append(error)

    threads = [threading.Thread(target=add) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
