from pathlib import Path
from xml.etree import ElementTree

import pytest
from recordings import scans
from results import write_result

from idem_ros.commands.main import main
from idem_ros.recording.writer import write_mcap


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_result('a.json', time_ms=[10, 20, 30], translation_error_m=[None] * 3)
    write_result('b.json', time_ms=[10, 20, 90], translation_error_m=[0.1] * 3)
    return tmp_path


def rules(*lines, file='rules.yaml'):
    Path(file).write_text('rules:\n' + ''.join(f'- {line}\n' for line in lines))
    return ['--rules', file]


def test_each_rule_is_printed_with_what_was_found(folder, capsys):
    assert main(['gate', 'a.json', *rules('time_ms.max < 50', 'frames >= 3')]) == 0
    assert capsys.readouterr().out.splitlines() == [
        'a.json: 2 of 2 rules hold',
        '  pass  time_ms.max < 50  30',
        '  pass  frames >= 3       3',
    ]


def test_one_rule_that_fails_in_one_result_fails_the_gate(folder, capsys):
    gate = rules('time_ms.max < 50', 'translation_error_m.p90 < 0.05')
    assert main(['gate', 'a.json', 'b.json', *gate]) == 1
    out = capsys.readouterr().out
    assert 'a.json: 1 of 2 rules hold' in out
    assert 'b.json: 0 of 2 rules hold' in out
    assert 'no frame has a translation_error_m; is there ground truth?' in out
    assert '  FAIL  time_ms.max < 50                90' in out


def test_junit_has_a_suite_a_result_and_a_case_a_rule(folder, capsys):
    gate = rules('time_ms.max < 50', 'translation_error_m.p90 < 0.05', 'dropped == 0')
    assert main(['gate', 'a.json', 'b.json', *gate, '--junit', 'gate.xml']) == 1
    root = ElementTree.parse('gate.xml').getroot()
    assert (root.tag, root.get('tests'), root.get('failures')) == ('testsuites', '6', '3')
    suites = root.findall('testsuite')
    assert [suite.get('name') for suite in suites] == ['a.json', 'b.json']
    assert [(s.get('tests'), s.get('failures')) for s in suites] == [('3', '1'), ('3', '2')]
    names = [case.get('name') for case in suites[0].findall('testcase')]
    assert names == ['time_ms.max < 50', 'translation_error_m.p90 < 0.05', 'dropped == 0']
    failures = [failure.get('message') for failure in root.iter('failure')]
    assert failures[1:] == ['found 90', 'found 0.1']
    assert 'ground truth' in failures[0]


def test_junit_is_xml_whatever_the_files_are_called(folder, capsys):
    name = 'a<&"\x01.json'
    (folder / 'a.json').rename(folder / name)
    assert main(['gate', name, *rules('frames >= 3'), '--junit', 'gate.xml']) == 0
    suite = ElementTree.parse('gate.xml').getroot().find('testsuite')
    assert suite.get('name') == 'a<&"?.json'


def test_a_replay_passes_its_gate(folder, rng, capsys):
    write_mcap('scans.mcap', scans(rng))
    assert main(['replay', 'scans.mcap', '--json', 'result.json', '--out', 'result.mcap']) == 0
    gate = rules(
        'frames == 3',
        'unpaired == 0',
        'status.converged == 1',
        'translation_error_m.p90 < 0.05',
        'translation_error_m_before.min > 0.01',
        'q_tot.max < 1e9',
        'time_ms.p95 > 0',
    )
    assert main(['gate', 'result.json', 'result.mcap', *gate]) == 0, capsys.readouterr().out


@pytest.mark.parametrize(
    ('argv', 'code', 'words'),
    [
        (['none.json'], 1, 'none.json cannot be read'),
        (['rules2.yaml'], 1, 'is no result of a replay'),
        (['a.json', '--rules', 'none.yaml'], 2, 'none.yaml cannot be read'),
        (['a.json', '--rules', 'rules2.yaml'], 2, "rule 1: no result has 'frame'"),
        (['a.json', 'a.json'], 2, 'a file is named twice'),
        (
            ['a.json', '--junit', './a.json'],
            2,
            '--junit is ./a.json, which would replace the input',
        ),
        (['a.json', '--junit', 'rules.yaml'], 2, 'which would replace the input'),
        (['a.json', '--junit', 'no/gate.xml'], 1, 'make it first'),
    ],
)
def test_bad_input_gets_one_line_and_writes_nothing(folder, capsys, argv, code, words):
    right = rules('frames >= 1')
    rules('frame.p90 >= 1', file='rules2.yaml')
    before = {file: file.read_text() for file in folder.iterdir()}
    assert main(['gate', *right, *argv]) == code
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.startswith('idem: error: ')
    assert captured.err.count('\n') == 1
    assert words in captured.err
    assert {file: file.read_text() for file in folder.iterdir()} == before


@pytest.mark.parametrize('missing', ['none.json', 'none\udcff.json'])
def test_what_cannot_be_read_takes_the_place_of_an_older_junit(folder, capsys, missing):
    gate = ['gate', *rules('frames >= 1'), '--junit', 'gate.xml']
    assert main([*gate, 'a.json']) == 0
    assert main([*gate, 'a.json', missing]) == 1
    root = ElementTree.parse('gate.xml').getroot()
    assert (root.get('tests'), root.get('failures'), root.get('errors')) == ('1', '0', '1')
    (error,) = root.iter('error')
    assert 'cannot be read' in error.get('message')


def test_rules_that_are_none_take_the_place_of_an_older_junit(folder, capsys):
    assert main(['gate', 'a.json', *rules('frame.p90 >= 1'), '--junit', 'gate.xml']) == 2
    (error,) = ElementTree.parse('gate.xml').getroot().iter('error')
    assert "no result has 'frame'" in error.get('message')


def test_rules_must_be_named(folder, capsys):
    with pytest.raises(SystemExit) as ended:
        main(['gate', 'a.json'])
    assert ended.value.code == 2
