import numpy as np
import pytest
from results import write_result
from scipy.stats import binom

from idem_ros.results.comparison import IncomparableResults, Verdict, compare, tally
from idem_ros.results.result_file import read_result


@pytest.fixture
def result(tmp_path):
    def write(name, **columns):
        write_result(tmp_path / name, **columns)
        return read_result(tmp_path / name)

    return write


def measure(comparison, name):
    return next(d for d in comparison.differences if d.measure == name)


def test_what_is_lower_in_each_frame_is_better_though_frames_differ_more(result, rng):
    errors = rng.uniform(0.01, 1.0, 20)
    lower = errors - rng.uniform(0.001, 0.002, 20)
    a = result('a.json', translation_error_m=list(errors), time_ms=[1.0] * 20)
    b = result('b.json', translation_error_m=list(lower), time_ms=[3.0] * 20)
    difference = measure(compare(a, b), 'translation_error_m')
    assert difference.verdict is Verdict.BETTER
    assert difference.median == pytest.approx(np.median(lower - errors))
    assert difference.median_a == pytest.approx(np.median(errors))
    assert -0.002 <= difference.low <= difference.median <= difference.high <= -0.001
    assert measure(compare(a, b), 'time_ms').verdict is Verdict.WORSE
    assert measure(compare(b, a), 'translation_error_m').verdict is Verdict.WORSE


def test_what_was_lost_and_how_the_others_were_judged_is_counted(tmp_path):
    verdicts = ['aligned'] * 6 + ['misaligned'] * 2
    write_result(tmp_path / 'a.json', verdict=verdicts, refused=1, dropped=2, unpaired=3)
    assert tally(read_result(tmp_path / 'a.json')) == {
        'frames': 8,
        'refused': 1,
        'dropped': 2,
        'unpaired': 3,
        'verdict aligned': 6,
        'verdict misaligned': 2,
    }


def test_noise_around_nothing_is_no_difference(result, rng):
    a, b = (result(n, rotation_error_deg=list(rng.random(30))) for n in ('a.json', 'b.json'))
    assert measure(compare(a, b), 'rotation_error_deg').verdict is Verdict.CANNOT_TELL
    same = measure(compare(a, a), 'rotation_error_deg')
    assert (same.low, same.high, same.verdict) == (0, 0, Verdict.CANNOT_TELL)


@pytest.mark.parametrize('count', [6, 7, 20, 41])
def test_the_interval_lies_between_the_order_statistics_of_the_sign_test(result, rng, count):
    differences = rng.normal(size=count)
    a = result('a.json', time_ms=[0.0] * count)
    b = result('b.json', time_ms=list(differences))
    found = measure(compare(a, b), 'time_ms')
    # the largest k with P(at most k - 1 of count below the median) <= 2.5 %
    k = max(k for k in range(1, count) if binom.cdf(k - 1, count, 0.5) <= 0.025)
    ordered = np.sort(differences)
    assert found.low == pytest.approx(ordered[k - 1])
    assert found.high == pytest.approx(ordered[count - k])


def test_frames_are_paired_by_stamp_and_the_others_counted(result):
    a = result('a.json', time_ms=[float(i) for i in range(12)])
    b = result('b.json', time_ms=[float(i) for i in range(10)])
    late = type(b)(b.path, b.bag, b.frames[:1:-1], b.counts)  # in another order, without two
    comparison = compare(a, late)
    assert (comparison.shared, comparison.only_a, comparison.only_b) == (8, 4, 0)
    assert measure(comparison, 'time_ms').median == 0
    assert compare(late, a).only_b == 4


def test_of_stamps_that_come_again_each_is_paired_once(result):
    a = result('a.json', time_ms=[1.0] * 6)
    twice = type(a)(a.path, a.bag, a.frames * 2, a.counts)
    assert compare(twice, twice).shared == 12
    comparison = compare(twice, a)
    assert (comparison.shared, comparison.only_a) == (6, 6)


def test_frames_without_truth_in_one_of_both_are_left_out(result):
    a = result('a.json', translation_error_m=[1.0] * 8, rotation_error_deg=[1.0] * 8)
    b = result('b.json', translation_error_m=[None] + [0.5] * 7, rotation_error_deg=[None] * 8)
    assert measure(compare(a, b), 'translation_error_m').frames == 7
    unknown = measure(compare(a, b), 'rotation_error_deg')
    assert (unknown.frames, unknown.median, unknown.low) == (0, None, None)
    assert (unknown.verdict, unknown.note) == (Verdict.CANNOT_TELL, 'not known in both')


def test_fewer_than_six_frames_with_truth_give_no_interval(result):
    b = result('b.json', translation_error_m=[0.5] * 5 + [None] * 3)
    a = result('a.json', translation_error_m=[1.0] * 8)
    few = measure(compare(a, b), 'translation_error_m')
    assert (few.frames, few.median, few.low, few.verdict) == (5, -0.5, None, Verdict.CANNOT_TELL)
    assert few.note == 'known in fewer than 6 frames'


def test_q_tot_is_not_compared_across_radii(result):
    a = result('a.json', q_tot=[10.0] * 9, radius=[0.5] * 9)
    b = result('b.json', q_tot=[1.0] * 2 + [9.0] * 7, radius=[0.6] * 2 + [0.5] * 7)
    difference = measure(compare(a, b), 'q_tot')
    assert (difference.frames, difference.median, difference.verdict) == (7, -1, Verdict.BETTER)
    assert difference.note == '2 frames left out: another radius, other units'
    other = result('c.json', q_tot=[1.0] * 9, radius=[0.6] * 9)
    assert measure(compare(a, other), 'q_tot').verdict is Verdict.CANNOT_TELL


@pytest.mark.parametrize(('count', 'words'), [(0, 'share no stamps'), (5, 'share 5 stamps')])
def test_too_few_frames_in_both_are_refused(result, count, words):
    a = result('a.json', time_ms=[1.0] * 9)
    b = result('b.json', time_ms=[1.0] * count)
    with pytest.raises(IncomparableResults) as refused:
        compare(a, b)
    assert words in str(refused.value)
    assert 'b.json' in str(refused.value)
