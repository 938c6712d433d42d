import json
from pathlib import Path

import pytest
from results import write_result

from idem_ros.commands.main import main


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_result('a.json', translation_error_m=[0.02, 0.03] * 4, time_ms=[10.0, 30.0] * 4)
    write_result('b.json', translation_error_m=[0.01, 0.02] * 4, time_ms=[20.0, 20.0] * 4)
    Path('empty.json').touch()
    write_result('few.json', time_ms=[1.0] * 5)
    write_result('other.json', bag='other.mcap', time_ms=[1.0] * 9)
    return tmp_path


def test_prints_a_verdict_for_each_measure(folder, capsys):
    assert main(['compare', 'a.json', 'b.json']) == 0
    out = capsys.readouterr().out
    assert 'A: a.json, of run.mcap' in out
    assert '8 frames in both, 0 only in A, 0 only in B' in out
    assert 'note' not in out
    rows = [[cell.strip() for cell in line.split('|')] for line in out.splitlines()]
    verdicts = {row[1]: row[-2] for row in rows if len(row) > 5}
    assert verdicts['translation error [m]'] == 'better'
    assert verdicts['time [ms]'] == 'cannot tell'
    assert verdicts['rotation error [deg]'] == 'cannot tell (not known in both)'


def test_results_of_different_recordings_are_refused(folder, capsys):
    assert main(['compare', 'a.json', 'other.json']) == 1
    err = capsys.readouterr().err
    assert 'a.json is of run.mcap and other.json of other.mcap' in err


@pytest.mark.parametrize(('sums', 'code'), [('aa', 0), ('ab', 1)])
def test_recordings_are_told_apart_by_their_checksums(folder, capsys, sums, code):
    for name, sum_ in zip('ab', sums, strict=True):
        record = json.loads(Path(f'{name}.json').read_text())
        record['made_by'] = {'input': {'name': f'run_{name}.mcap', 'size': 1, 'sha256': sum_ * 64}}
        Path(f'{name}.json').write_text(json.dumps(record))
    assert main(['compare', 'a.json', 'b.json']) == code
    assert ('run_b.mcap' in capsys.readouterr().err) == bool(code)


def test_json_holds_the_same(folder, capsys):
    assert main(['compare', 'a.json', 'b.json', '--json']) == 0
    record = json.loads(capsys.readouterr().out)
    assert record['a'] == {'path': 'a.json', 'bag': 'run.mcap'}
    assert record['frames'] == {'shared': 8, 'only_a': 0, 'only_b': 0}
    first = record['differences'][0]
    assert (first['measure'], first['verdict']) == ('translation_error_m', 'better')
    assert (first['low'], first['high']) == pytest.approx((-0.01, -0.01))


def made_with(path, **parameters):
    record = json.loads(Path(path).read_text())
    record['made_by'] = {'parameters': parameters, 'sequence': None}
    Path(path).write_text(json.dumps(record))


def test_two_results_of_another_kind_are_told_apart_by_their_settings(folder, capsys):
    made_with('a.json', mode='refine', voxel_size=0.5, threads=1)
    made_with('b.json', mode='audit', voxel_size=1.5, threads=1)
    assert main(['compare', 'a.json', 'b.json']) == 0
    out = capsys.readouterr().out
    rows = [line.replace('|', ' ').split() for line in out.splitlines()]
    assert ['mode', 'refine', 'audit'] in rows
    assert ['voxel_size', '0.5', '1.5'] in rows
    assert 'threads' not in out
    assert main(['compare', 'a.json', 'b.json', '--json']) == 0
    settings = json.loads(capsys.readouterr().out)['settings']
    assert settings['mode'] == {'a': 'refine', 'b': 'audit'}
    assert len(settings) == 2


@pytest.mark.parametrize(
    ('content', 'words'),
    [
        ({'evaluated': 2, 'recordings': []}, 'whose results lie beside it'),
        ({'keyframes': 3, 'relations': []}, 'the record of an idem smooth'),
        ({'sensors': {}, 'transforms': []}, 'the record of an idem calibrate'),
        ({'poses': [], 'edges': []}, 'what idem align prints'),
        ({'T_target_source': []}, 'what idem register prints'),
        ([1, 2], 'it lacks "frames" or "summary"'),
    ],
)
def test_what_another_command_wrote_is_named(folder, capsys, content, words):
    Path('b.json').write_text(json.dumps(content))
    assert main(['compare', 'a.json', 'b.json']) == 1
    err = capsys.readouterr().err
    assert words in err
    assert 'idem replay BAG --json FILE' in err
    assert err.count('\n') == 1


@pytest.mark.parametrize(
    ('argv', 'words'),
    [
        (['a.json', 'few.json'], 'share 5 stamps; a comparison needs 6'),
        (['a.json', 'none.json'], 'none.json cannot be read'),
        (['a.json', 'empty.json'], 'it is no JSON: it is empty'),
        (['a.json', '.'], 'it is a folder; name a file in it'),
    ],
)
def test_what_cannot_be_compared_gets_one_line(folder, capsys, argv, words):
    assert main(['compare', *argv]) == 1
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.startswith('idem: error: ')
    assert captured.err.count('\n') == 1
    assert words in captured.err


def test_what_medians_do_not_show_is_printed_and_in_the_json(tmp_path, capsys):
    time_ms = [1.0] * 8
    good, bad = ['aligned'] * 8, ['aligned'] * 5 + ['outside_basin'] * 3
    write_result(tmp_path / 'a.json', verdict=good, time_ms=time_ms)
    write_result(tmp_path / 'b.json', verdict=bad, time_ms=time_ms, dropped=4)
    files = [str(tmp_path / name) for name in ('a.json', 'b.json')]
    assert main(['compare', *files]) == 0
    rows = [line.strip('| ').split() for line in capsys.readouterr().out.splitlines()]
    assert ['dropped', '|', '0', '|', '4', '|', '+4'] in rows
    assert ['verdict', 'outside_basin', '|', '0', '|', '3', '|', '+3'] in rows
    assert main(['compare', *files, '--json']) == 0
    assert json.loads(capsys.readouterr().out)['sources']['b']['verdict aligned'] == 5
