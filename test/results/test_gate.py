import json

import numpy as np
import pytest
from results import write_result

from idem_ros.results.gate import BadRules, findings, read_rules
from idem_ros.results.result_file import read_result

ERRORS = [0.01, 0.02, 0.03, 0.04, None]


@pytest.fixture
def result(tmp_path):
    write_result(
        tmp_path / 'a.json',
        statuses=['converged'] * 4 + ['no_overlap'],
        dropped=2,
        translation_error_m=ERRORS,
        time_ms=[10, 20, 30, 40, 50],
        rotation_error_deg=[None] * 5,
        verdict=['aligned'] * 3 + ['degenerate', 'separated'],
    )
    return read_result(tmp_path / 'a.json')


def rules_of(tmp_path, *rules):
    path = tmp_path / 'rules.yaml'
    path.write_text('rules:\n' + ''.join(f'  - {rule}\n' for rule in rules))
    return read_rules(path)


def found(tmp_path, result, rule):
    [[finding]] = findings(rules_of(tmp_path, rule), [result])
    return finding


@pytest.mark.parametrize(
    ('term', 'value'),
    [
        ('time_ms.mean', 30),
        ('time_ms.median', 30),
        ('time_ms.min', 10),
        ('time_ms.max', 50),
        ('time_ms.count', 5),
        ('time_ms.p95', np.percentile([10, 20, 30, 40, 50], 95)),
        ('time_ms.p99.9', np.percentile([10, 20, 30, 40, 50], 99.9)),
        ('time_ms.p1', np.percentile([10, 20, 30, 40, 50], 1)),
        ('translation_error_m.median', 0.025),
        ('translation_error_m.count', 4),
        ('rotation_error_deg.count', 0),
        ('status.converged', 0.8),
        ('status.no_overlap', 0.2),
        ('status.degenerate', 0),
        ('verdict.aligned', 0.6),
        ('verdict.misaligned', 0),
        ('frames', 5),
        ('dropped', 2),
        ('refused', 0),
    ],
)
def test_the_value_of_a_term(tmp_path, result, term, value):
    finding = found(tmp_path, result, f'{term} >= -1e3')
    assert finding.value == pytest.approx(value)
    assert (finding.holds, finding.reason) == (True, '')


@pytest.mark.parametrize(
    ('rule', 'holds'),
    [
        ('dropped == 2', True),
        ('dropped == 0', False),
        ('dropped != 2', False),
        ('dropped!=0', True),
        ('dropped<2', False),
        ('dropped <= 2.0', True),
        ('dropped > 2', False),
        ('dropped >= +2e0', True),
        ('dropped > -.5', True),
        ('time_ms.mean < 30.', False),
    ],
)
def test_a_rule_holds_or_does_not(tmp_path, result, rule, holds):
    assert found(tmp_path, result, rule).holds is holds


@pytest.mark.parametrize('operator', ['<', '>', '!=', '=='])
def test_a_value_that_is_missing_fails_whatever_the_rule(tmp_path, result, operator):
    finding = found(tmp_path, result, f'rotation_error_deg.max {operator} 1')
    assert (finding.value, finding.holds) == (None, False)
    assert finding.reason == 'no frame has a rotation_error_deg; is there ground truth?'


def test_a_result_without_frames_fails_what_is_said_of_frames(tmp_path):
    write_result(tmp_path / 'a.json', refused=3)
    rules = rules_of(
        tmp_path, 'frames >= 1', 'time_ms.p95 < 1', 'status.converged > 0', 'refused == 3'
    )
    [results] = findings(rules, [read_result(tmp_path / 'a.json')])
    assert [finding.holds for finding in results] == [False, False, False, True]
    assert results[1].reason == 'no frame was refined'


def test_a_name_that_one_result_has_is_missing_in_the_others(tmp_path, result):
    write_result(tmp_path / 'b.json', overlap=[0.5])
    rules = rules_of(tmp_path, 'overlap.min >= 0.5')
    [[first], [second]] = findings(rules, [result, read_result(tmp_path / 'b.json')])
    assert (first.holds, first.reason) == (False, 'no frame has a overlap')
    assert second.holds


@pytest.mark.parametrize(
    ('rule', 'words'),
    [
        ('time_ms.p95', 'it must be NAME[.STATISTIC] OP NUMBER'),
        ('time_ms.p95 < 100 ms', 'it must be NAME'),
        ('time_ms.p95 < x', 'it must be NAME'),
        ('time_ms.p95 < nan', 'it must be NAME'),
        ('time_ms.p95 < 1e999', 'it must be NAME'),
        ('time_ms.p95 = 3', 'it must be NAME'),
        ('time_ms.p95 =< 3', 'it must be NAME'),
        ('1 < time_ms.p95', 'it must be NAME'),
        ('0 < time_ms.p95 < 1', 'it must be NAME'),
        ('__import__("os") == 0', 'it must be NAME'),
        ('5', 'it must be NAME'),
        ('a: b', "is 'a mapping'; it must be NAME"),
        ('[frames > 1]', "is 'a sequence'; it must be NAME"),
        ('', "is ''; it must be NAME"),
        ('time_ms < 3', 'must name a statistic, as in time_ms.p95: mean, median'),
        ('time_ms.p0 < 3', 'must name a statistic'),
        ('time_ms.p100 < 3', 'must name a statistic'),
        ('time_ms.p05 < 3', 'must name a statistic'),
        ('time_ms.std < 3', 'must name a statistic'),
        (
            'times_ms.p95 < 3',
            "no result has 'times_ms'; there are chunks_left_out, dropped, files_",
        ),
        ('stamp_ns.p95 < 3', "no result has 'stamp_ns'"),
        ('frames.count > 3', 'frames is a count; write it without a statistic'),
        ('status == 1', 'must begin with status.converged, status.max_iterations'),
        ('status.convergd > 0', 'must begin with status.converged'),
    ],
)
def test_a_bad_rule_is_refused_by_file_and_number(tmp_path, result, rule, words):
    with pytest.raises(BadRules) as refused:
        findings(rules_of(tmp_path, 'frames > 1', rule), [result])
    assert str(refused.value).startswith(f'{tmp_path / "rules.yaml"}, rule 2')
    assert words in str(refused.value)
    assert '\n' not in str(refused.value)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('', 'must hold one list named rules'),
        ('- frames > 1', 'must hold one list named rules'),
        ('rules: frames > 1', 'must hold one list named rules'),
        ('rules: [frames > 1]\nrule: [frames > 2]', 'must hold one list named rules'),
        ('rules: [frames > 1]\nrules: [frames > 2]', 'must hold one list named rules'),
        ('rules: []', 'holds no rule'),
        ('rules: [frames > 1', 'is no YAML'),
        ('rules:\n\t- a', 'is no YAML'),
        ('rules: [a]\n--- \nrules: [b]', 'is no YAML'),
    ],
)
def test_a_file_that_holds_no_rules_is_refused_in_one_line(tmp_path, text, words):
    path = tmp_path / 'rules.yaml'
    path.write_text(text)
    with pytest.raises(BadRules) as refused:
        read_rules(path)
    assert str(refused.value).startswith(str(path))
    assert words in str(refused.value)
    assert '\n' not in str(refused.value)


def test_rules_that_are_not_there_are_refused(tmp_path):
    with pytest.raises(BadRules, match='none.yaml cannot be read'):
        read_rules(tmp_path / 'none.yaml')


def test_a_verdict_that_no_frame_has_fails_its_rule(tmp_path):
    write_result(tmp_path / 'icp.json', statuses=['converged'] * 2)
    finding = found(tmp_path, read_result(tmp_path / 'icp.json'), 'verdict.aligned >= 0')
    assert (finding.value, finding.holds) == (None, False)
    assert finding.reason == 'no frame has a verdict'


def test_a_rule_of_many_digits_is_refused_before_it_is_matched(tmp_path):
    with pytest.raises(BadRules, match='rule 1 has 100010 letters'):
        rules_of(tmp_path, 'frames > ' + '1' * 100_000 + 'x')


def test_an_interrupted_or_partial_result_does_not_pass_unless_a_rule_allows_it(tmp_path):
    path = tmp_path / 'a.json'
    write_result(path, time_ms=[10, 20, 30])
    record = json.loads(path.read_text())
    record['summary'] |= {'interrupted': True, 'messages_left_out': 3, 'files_extra': 1}
    path.write_text(json.dumps(record))
    [kept] = findings(rules_of(tmp_path, 'frames >= 1'), [read_result(path)])
    assert [(each.rule.text, each.holds) for each in kept] == [
        ('frames >= 1', True),
        ('interrupted == 0', False),
        ('messages_left_out == 0', False),
    ]
    rules = rules_of(tmp_path, 'interrupted <= 1', 'messages_left_out < 5', 'files_extra == 0')
    [spoken] = findings(rules, [read_result(path)])
    assert [(each.value, each.holds) for each in spoken] == [(1, True), (3, True), (1, False)]
