import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from clouds import surface

from benchmarks import accuracy_report
from benchmarks.accuracy import Figures, RowResult, measure_rows
from benchmarks.case import LEVELS, Case
from benchmarks.chance import ratio_interval
from benchmarks.commands.main import main
from benchmarks.earlier import NotMeasured, with_peers_of
from benchmarks.judged_figures import verdicts
from benchmarks.methods import PEERS, Setting, settings
from benchmarks.rows import Row, accuracy_rows
from idem_ros.core import RegistrationConfig


def tiny_case(seed):
    rng = np.random.default_rng(seed)
    return Case(f'tiny {seed}', surface(rng, 300), surface(rng, 300), np.eye(4))


TINY = Row('tiny', 'condition', (partial(tiny_case, 0), partial(tiny_case, 1)), 1)


def figures(method, error=1.0, success=1.0):
    values = dict.fromkeys(('median', 'p90', 'median_successful', 'p90_successful'), error)
    each = (error,) * 20
    return Figures(method, Setting(method), 20, success, values, values, each, each)


def result(idem, peer, **uncertainty):
    truth = {'truth_rotation_deg': 0.0, 'truth_translation_m': 0.0, **uncertainty}
    others = [figures(method, 99.0, 0.0) for method in PEERS[1:]]
    level = (figures('IDEM', *idem), figures(PEERS[0], *peer), *others)
    return RowResult('row', 'real', 0.5, levels=(level,) * len(LEVELS), **truth)


def test_rows_are_measured_alike_by_one_process_and_by_two():
    pytest.importorskip('small_gicp')
    tried = settings((3.0,), (1.5,))
    alone = measure_rows([TINY], tried, RegistrationConfig())
    shared = measure_rows([TINY], tried, RegistrationConfig(), jobs=2)
    assert alone == shared
    assert [f.method for f in alone[0].levels[0]] == ['IDEM', *PEERS]
    assert all(f.runs == 2 for level in alone[0].levels for f in level)
    assert alone[0].levels[0][0].success == 1.0


def test_a_peer_bears_its_best_setting():
    pytest.importorskip('small_gicp')
    tried = [Setting('GICP', 1e-3), Setting('GICP', 3.0)]
    tried += [setting for setting in settings((3.0,), (1.5,)) if setting.method != 'GICP']
    (measured,) = measure_rows([TINY], tried, RegistrationConfig())
    gicp = measured.levels[0][1 + PEERS.index('GICP')]
    assert gicp.setting == Setting('GICP', 3.0)


def test_after_the_trial_only_the_best_setting_goes_on():
    pytest.importorskip('small_gicp')
    tried = [Setting('GICP', 1e-3), *settings((3.0,), (1.5,))]
    row = replace(TINY, builders=TINY.builders[:1], starts=6)
    (measured,) = measure_rows([row], tried, RegistrationConfig())
    gicp = measured.levels[0][1 + PEERS.index('GICP')]
    assert (gicp.setting, gicp.runs) == (Setting('GICP', 3.0), 6)


def test_a_figure_is_missed_where_a_peer_is_better():
    lines = {v.figure: v for v in verdicts([result((2.0, 0.9), (1.0, 1.0))])}
    assert len(lines) == 4 + len(LEVELS)
    assert all(v.missed and v.reached == 0 for v in lines.values())
    assert 'ICP' in str(next(iter(lines.values())))


def test_a_figure_is_reached_by_an_equal_and_within_the_truths_uncertainty():
    equal = result((1.0, 1.0), (1.0, 1.0))
    within = result((2.0, 1.0), (1.0, 1.0), truth_rotation_deg=2.0, truth_translation_m=2.0)
    for v in verdicts([equal, within]):
        assert not v.missed
        assert v.reached == 2
        assert v.undecided == ('error' in v.figure)
        assert ("a peer's is smaller" in str(v)) == ('error' in v.figure)


def test_the_interval_of_a_ratio_is_that_of_resampled_pairs():
    rng = np.random.default_rng(0)
    theirs = rng.exponential(size=40)
    assert ratio_interval(2.0 * theirs, theirs, 50) == pytest.approx((2.0, 2.0))
    low, high = ratio_interval(rng.exponential(size=40), theirs, 90)
    assert 0.2 < low < 1.0 < high < 5.0
    assert ratio_interval([1.0, None], [1.0, 1.0], 50) is None
    assert ratio_interval([1.0, 1.0], [1.0, np.inf], 50) is None


def test_a_row_says_what_of_it_is_chance_where_its_cases_are_drawn():
    won = replace(result((0.5, 1.0), (1.0, 1.0)), kind='condition')
    lost = replace(result((2.0, 1.0), (1.0, 1.0)), kind='simulated')
    first, *_ = verdicts([won, lost])
    assert (first.reached, first.clearly) == (1, 1)
    assert 'by chance 2.00 to 2.00 times' in str(first)
    first, *_ = verdicts([result((0.5, 1.0), (1.0, 1.0)), result((2.0, 1.0), (1.0, 1.0))])
    assert (first.reached, first.clearly) == (1, 0)
    assert 'chance' not in str(first)


def test_an_error_without_bound_loses():
    (first, *_) = verdicts([result((None, 0.0), (1.0, 1.0))])
    assert first.missed


def test_the_report_holds_every_row_and_level_as_json_and_as_markdown():
    results = [result((2.0, 0.9), (1.0, 1.0))]
    record = json.loads(json.dumps(accuracy_report.json_record(results), allow_nan=False))
    assert len(record['rows'][0]['levels']) == len(LEVELS)
    text = accuracy_report.markdown(results)
    assert text.count('| row (') == text.count('From ') == len(LEVELS)
    assert 'MISSED' in text


def test_rows_bear_unique_names_and_are_found_by_a_part_of_them():
    rows = accuracy_rows()
    names = [row.name for row in rows]
    assert len(names) == len(set(names))
    assert all(len(row.builders) * row.starts >= 20 for row in rows)
    assert [row.name for row in accuracy_rows('Density')] == ['density 10:1']
    assert 0 < len(accuracy_rows(quick=True)) < len(rows)


def test_the_command_measures_one_row_and_takes_the_peers_of_an_earlier_run(tmp_path, capsys):
    pytest.importorskip('small_gicp')
    first, second = tmp_path / 'first.json', tmp_path / 'second.json'
    command = ['accuracy', '--quick', '--rows', 'density', '--jobs', '1']
    assert main([*command, '--json', str(first)]) == 0
    assert json.loads(first.read_text())['rows'][0]['name'] == 'density 10:1'
    assert '| density 10:1' in capsys.readouterr().out
    assert main([*command, '--peers', str(first), '--json', str(second)]) == 0
    assert json.loads(second.read_text()) == json.loads(first.read_text())


def test_peers_of_other_runs_or_rows_are_refused(tmp_path):
    earlier = tmp_path / 'earlier.json'
    (ours,) = accuracy_report.json_record([result((1.0, 1.0), (1.0, 1.0))])['rows']
    ours['levels'][0][0]['runs'] += 1
    earlier.write_text(json.dumps({'rows': [ours]}))
    with pytest.raises(NotMeasured, match='give --quick both times or never'):
        with_peers_of([result((1.0, 1.0), (1.0, 1.0))], earlier)
    with pytest.raises(NotMeasured, match="lacks the row 'holes'"):
        with_peers_of([replace(result((1.0, 1.0), (1.0, 1.0)), name='holes')], earlier)


@pytest.mark.parametrize('content', ['', '[]', '{}', 'no JSON'])
def test_a_file_without_figures_is_refused(tmp_path, content):
    file = tmp_path / 'wrong.json'
    file.write_text(content)
    with pytest.raises(NotMeasured, match='wrong.json'):
        with_peers_of([], file)


@pytest.mark.parametrize('wrong', [['--rows', 'nothing'], ['--jobs', '0'], ['--a', '-1']])
def test_wrong_options_are_refused_in_one_line(wrong, capsys):
    assert main(['accuracy', *wrong]) == 2
    assert capsys.readouterr().err.count('\n') == 1
