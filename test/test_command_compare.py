import json

import pytest
from results import write_result

from idem_ros.commands.main import main


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_result('a.json', translation_error_m=[0.02, 0.03] * 4, time_ms=[10.0, 30.0] * 4)
    write_result('b.json', translation_error_m=[0.01, 0.02] * 4, time_ms=[20.0, 20.0] * 4)
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


def test_recordings_of_other_names_are_noted(folder, capsys):
    assert main(['compare', 'a.json', 'other.json']) == 0
    out = capsys.readouterr().out
    assert '0 only in A, 1 only in B' in out
    assert 'note: the two are of recordings with different names' in out


def test_json_holds_the_same(folder, capsys):
    assert main(['compare', 'a.json', 'b.json', '--json']) == 0
    record = json.loads(capsys.readouterr().out)
    assert record['a'] == {'path': 'a.json', 'bag': 'run.mcap'}
    assert record['frames'] == {'shared': 8, 'only_a': 0, 'only_b': 0}
    first = record['differences'][0]
    assert (first['measure'], first['verdict']) == ('translation_error_m', 'better')
    assert (first['low'], first['high']) == pytest.approx((-0.01, -0.01))


@pytest.mark.parametrize(
    ('argv', 'words'),
    [
        (['a.json', 'few.json'], 'share 5 stamps; a comparison needs 6'),
        (['a.json', 'none.json'], 'none.json cannot be read'),
    ],
)
def test_what_cannot_be_compared_gets_one_line(folder, capsys, argv, words):
    assert main(['compare', *argv]) == 1
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.startswith('idem: error: ')
    assert captured.err.count('\n') == 1
    assert words in captured.err
