import json
from collections import Counter
from functools import partial

import numpy as np
import pytest

from benchmarks.ablate import Compared, Number, Run, ablate, compared_record, numbers
from benchmarks.ablate_cases import STARTS, unseen
from benchmarks.ablate_report import ablation_markdown
from benchmarks.case import Case, Unseen
from benchmarks.commands.main import main
from benchmarks.conditions import UNSEEN_SEEDS, condition
from benchmarks.rows import SEEDS
from idem_ros.core.tuning import SolverTuning
from idem_ros.simulation.body import BUNNY, random_body, surface_points

NUMBER = Number('width', 2.0, 'far guesses', 1.0, 'tuning')


def run(rotation=0.1, right=True, ms=10.0, aligned=True):
    return Run(rotation, 0.2, right, ms, aligned, 1.0)


def small_case():
    case = condition('similar', UNSEEN_SEEDS[0])
    return Case('small', case.target[::5], case.source[::3], case.truth)


def test_every_number_has_a_reason_and_a_neutral_value_that_differs():
    for number in numbers():
        assert len(number.reason.split()) > 3, number.name
        assert number.value != number.neutral, number.name


def test_unseen_cases_are_of_other_seeds_than_those_that_numbers_are_chosen_on():
    assert max(SEEDS.values()) < UNSEEN_SEEDS[0]
    seeds = [arg for case in unseen() for arg in case.build.args if isinstance(arg, int)]
    assert len(seeds) > 100
    assert min(seeds) >= UNSEEN_SEEDS[0]


def test_a_random_body_is_another_surface_sampled_as_the_first_is(rng):
    body = random_body(rng)
    points, bunny = (surface_points(np.random.default_rng(1), 500, b) for b in (body, BUNNY))
    assert points.shape == bunny.shape
    assert not np.allclose(points, bunny)
    assert np.linalg.norm(points, axis=1).max() < 0.3


def test_ablate_runs_the_same_starts_with_and_without_a_number():
    name, value = 'ease', SolverTuning().ease
    (number,) = numbers([name])
    compared = ablate([Unseen('small', small_case)], [number])
    assert [(each.number, each.group, each.level) for each in compared] == [
        (name, 'small', level) for level in STARTS
    ]
    assert number.value == value
    for each in compared:
        assert len(each.tuned) == len(each.neutral) == 1
        assert each.tuned[0].rotation == pytest.approx(each.neutral[0].rotation, abs=0.2)
    assert len(json.loads(json.dumps(compared_record(compared)))['compared']) == len(STARTS)


def test_what_a_registration_does_not_ask_for_is_not_run_again():
    for each in ablate([Unseen('small', small_case)], numbers(['pattern_votes'])):
        assert each.tuned == each.neutral, each.level


def test_of_each_kind_as_many_cases_are_drawn_as_asked_for():
    of_all, drawn = (Counter(case.group for case in unseen(trials=n)) for n in (None, 2))
    assert drawn == {group: min(count, 2) for group, count in of_all.items()}


def test_the_report_tells_what_is_lost_and_what_is_beyond_chance():
    tuned = tuple(run(0.1 + 0.001 * k) for k in range(20)) + (run(),)
    neutral = tuple(run(0.2 + 0.001 * k, ms=5.0) for k in range(20)) + (run(9.0, right=False),)
    text = ablation_markdown([NUMBER], [Compared('width', 'bodies', 'near', tuned, neutral)])
    (row,) = (line for line in text.splitlines() if line.startswith('| width'))
    cells = [cell.strip() for cell in row.split('|')[1:-1]]
    assert cells[1:7] == ['2', '1', '21', '21', '1 / 0', '0 → 1']
    assert cells[9].startswith('1.00')
    assert float(cells[7].split()[0]) == pytest.approx(1.9, abs=0.1)
    lost = 'right only with it 1, only without 0; aligned but wrong 0 → 1'
    assert f'- width, bodies (21): {lost}; rotation 1.9' in text


def test_a_number_that_changes_nothing_is_beyond_chance_nowhere():
    same = tuple(run(0.1 + 0.001 * k) for k in range(20))
    text = ablation_markdown([NUMBER], [Compared('width', 'bodies', 'near', same, same)])
    assert 'Nothing.' in text


def test_the_report_of_trust_counts_verdicts():
    trust = NUMBER._replace(name='least', of='trust')
    tuned = (run(), run(right=False, aligned=False))
    neutral = (run(), run(right=False, aligned=True))
    text = ablation_markdown([trust], [Compared('least', 'bodies', 'far', tuned, neutral)])
    (row,) = (line for line in text.splitlines() if line.startswith('| least'))
    assert [cell.strip() for cell in row.split('|')[5:8]] == ['1 → 1', '0 → 1', '0 → 0']


@pytest.mark.parametrize(
    'wrong',
    [['--number', 'nosuch'], ['--cases', 'nosuch'], ['--jobs', '0'], ['--trials', '0']],
)
def test_what_ablate_does_not_know_is_refused(wrong, capsys):
    assert main(['ablate', *wrong]) == 2
    assert wrong[0] in capsys.readouterr().err


def test_an_unseen_case_is_right_within_its_own_limits():
    case = small_case()
    real = Unseen('real', partial(small_case), right=(2.0, 0.01))
    assert real.is_right(case, 1.5, 0.005)
    assert not real.is_right(case, 1.5, 0.02)
    assert not Unseen('made', small_case).is_right(case, 1.5, 0.0)
