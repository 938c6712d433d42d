import json
import time
from dataclasses import replace

import numpy as np
import pytest
from clouds import surface

from benchmarks import speed_report
from benchmarks.case import LEVELS, Case, errors, starts, succeeded
from benchmarks.footprint import first_result, memory
from benchmarks.methods import IDEM, PEERS
from benchmarks.q_tot_time import q_tot_ms
from benchmarks.raw_to_result import idem_from_raw, peer_from_raw, peer_settings
from benchmarks.speed import as_given_ms, growth, measure_row
from benchmarks.speed_cases import dense_street, speed_rows, staircase
from benchmarks.speed_run import SpeedResult
from benchmarks.time_to_accuracy import Tradeoff, judged
from benchmarks.timing import interleaved_ms, median_and_p95
from idem_ros.core import RegistrationConfig, search_radius

CONFIG = RegistrationConfig()


def tiny_case(points=1500):
    rng = np.random.default_rng(0)
    return Case('tiny', surface(rng, points), surface(rng, points), np.eye(4), voxel_size=0.1)


def tradeoff(method, milliseconds, moved_m):
    return Tradeoff(method, 'some', 0.5, milliseconds, 0.1, 0.1, moved_m, 1.0)


@pytest.fixture(scope='module')
def row():
    pytest.importorskip('small_gicp')
    return measure_row('street tiny', tiny_case(), CONFIG, rounds=2, seconds=0.0)


def test_calls_take_turns_and_each_round_begins_with_another():
    order = []
    calls = {name: lambda k, name=name: order.append((name, k)) for name in 'ab'}
    times = interleaved_ms(calls, 2)
    assert order == [('a', 0), ('b', 0), ('a', 0), ('b', 0), ('b', 1), ('a', 1)]
    assert {name: len(ms) for name, ms in times.items()} == {'a': 2, 'b': 2}


def test_rounds_go_on_until_the_time_is_over_but_not_beyond_the_most():
    assert len(interleaved_ms({'a': lambda _: None}, 1, seconds=60.0, most=7)['a']) == 7


def test_times_are_milliseconds():
    def spend(_):
        until = time.perf_counter_ns() + 2_000_000
        while time.perf_counter_ns() < until:
            pass

    assert interleaved_ms({'spend': spend}, 1)['spend'][0] >= 2.0
    assert median_and_p95([1.0, 2.0, 3.0]) == {'median': 2.0, 'p95': 2.9, 'rounds': 3}


def test_the_exponent_is_that_between_the_smallest_and_the_largest():
    assert growth([(10, 1.0), (1000, 100.0), (100, 5.0)]) == pytest.approx(1.0)
    assert growth([(10, 1.0), (1000, 10.0)]) == pytest.approx(0.5)


@pytest.mark.parametrize('threads', [1, 2])
@pytest.mark.parametrize('tight', [False, True])
def test_every_method_reaches_the_truth_from_raw_points(threads, tight):
    pytest.importorskip('small_gicp')
    case = tiny_case()
    (start,) = starts(case, LEVELS[0], 1)
    runs = [idem_from_raw(case, CONFIG, threads)]
    runs += [
        peer_from_raw(case, setting, threads, tight)
        for setting in peer_settings()
        if setting.distance == 3.0 or setting.resolution == 1.5
    ]
    assert len(runs) == 1 + len(PEERS)
    for run in runs:
        assert succeeded(case, *errors(case, run(start)))


def test_a_row_holds_every_method_with_one_thread_and_with_two(row):
    methods = (IDEM, *PEERS)
    assert set(row.whole) == {(method, n) for method in methods for n in (1, 2)}
    assert set(row.success) == set(methods)
    assert row.success[IDEM] == 1.0
    assert {method for method, _ in row.parts} == {IDEM, 'GICP'}
    both = [row.whole[method, 2]['median'] for method in (IDEM, 'GICP')]
    assert row.ratio(threads=2) == pytest.approx(both[0] / both[1])


def test_the_race_takes_the_fastest_of_idem_that_is_as_good_as_the_best_peer():
    tradeoffs = [
        *(tradeoff('GICP', 40.0, 0.003), tradeoff('GICP', 50.0, 0.004)),
        tradeoff('VGICP', 20.0, 0.005),
        *(tradeoff(IDEM, 5.0, 0.006), tradeoff(IDEM, 10.0, 0.003), tradeoff(IDEM, 30.0, 0.001)),
    ]
    race = judged('street', tradeoffs)
    assert race.best_peer is tradeoffs[0]
    assert race.idem is tradeoffs[4]
    assert race.ratio == pytest.approx(0.25)
    assert tradeoffs[1] not in race.tradeoffs
    assert len(race.tradeoffs) == 5
    assert race.near.best_peer is tradeoffs[0]


def test_a_faster_peer_that_is_nearly_as_good_is_raced_too():
    tradeoffs = [tradeoff('GICP', 40.0, 0.003), tradeoff('VGICP', 20.0, 0.0039)]
    tradeoffs += [tradeoff(IDEM, 8.0, 0.0035), tradeoff(IDEM, 16.0, 0.002)]
    race = judged('street', tradeoffs)
    assert (race.best_peer, race.ratio) == (tradeoffs[0], 0.4)
    assert (race.near.best_peer, race.near.ratio) == (tradeoffs[1], 0.4)
    assert race.near.idem is tradeoffs[2]


def test_a_race_that_idem_never_reaches_has_no_ratio():
    race = judged('street', [tradeoff('GICP', 40.0, 0.001), tradeoff(IDEM, 5.0, 0.002)])
    assert race.idem is None
    assert race.ratio is None


def test_a_dense_street_has_exactly_so_many_points():
    case = dense_street('some', 5_000, 0.5)
    assert (len(case.target), len(case.source)) == (5_000, 5_000)
    assert 0 < len(speed_rows(quick=True)) < len(speed_rows())


def test_the_staircase_has_the_papers_sizes_and_search_radius(rng):
    target, source = staircase(rng)
    assert (len(target), len(source)) == (34_101, 16_101)
    assert search_radius(target, source) == pytest.approx(0.14, abs=0.01)


def test_memory_is_that_of_a_fresh_process_for_a_registration_and_for_a_q_tot():
    used = memory(tiny_case(20_000))
    assert set(used) == {'register', 'q_tot'}
    for bytes_a_point in used.values():
        assert 24 < bytes_a_point['python'] < 5000
        assert bytes_a_point['resident'] > 0


def test_the_first_result_comes_from_a_process_of_its_own():
    case = tiny_case()
    seconds, said = first_result(case, case.truth, cold=False)
    assert seconds > 0.0
    assert 'Traceback' not in said


def test_the_report_holds_every_goal_and_table_as_json_and_as_markdown(row):
    result = SpeedResult(
        rows=[row],
        as_given={n: as_given_ms(tiny_case(n), CONFIG, 1) for n in (300, 600)},
        races=[judged('street', [tradeoff('GICP', 40.0, 0.001), tradeoff(IDEM, 5.0, 0.002)])],
        q_tot=q_tot_ms(1, (400, 200)),
        memory={'register': {'resident': 401.0, 'python': 1.0}},
        memory_points=10,
        first_result={'warm': 1.0, 'cold': 9.0, 'cold_says': ''},
    )
    # One size gives no exponent: a second row of the street, of other points.
    result.rows.append(replace(row, name='street more', points=(3000, 3000)))
    record = json.loads(json.dumps(speed_report.json_record(result), allow_nan=False))
    reached = {goal['figure']: goal['reached'] for goal in record['goals']}
    assert reached['peak memory of register a point'] is False
    assert reached['first result, warm cache'] is True
    assert reached["street: time to the best peer's accuracy / its time"] is False
    text = speed_report.markdown(result)
    for heading in ('1 thread', '2 threads', 'Parts', 'Error against time: street', 'Alone'):
        assert f'### {heading}' in text
