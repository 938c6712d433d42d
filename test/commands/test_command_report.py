import csv
import io

import pytest
from replayed import changed, write_replayed

from idem_ros.commands.main import main
from idem_ros.report import plots as report_plots


@pytest.fixture(autouse=True)
def few_measures(monkeypatch):
    monkeypatch.setattr(report_plots, 'MEASURES', report_plots.MEASURES[:1])


def test_the_page_is_named_and_the_exit_code_is_0(tmp_path, capsys):
    result = write_replayed(tmp_path, n=1)
    assert main(['report', str(result), '--out', str(tmp_path / 'report')]) == 0
    assert capsys.readouterr().out.startswith(f'{tmp_path / "report" / "report.html"}: ')
    assert (tmp_path / 'report' / 'report.html').is_file()


def test_a_result_of_replay_as_mcap_is_reported_like_that_as_json(tmp_path, capsys):
    write_replayed(tmp_path, n=2)
    outputs = ['--out', str(tmp_path / 'r.mcap'), '--json', str(tmp_path / 'r.json')]
    assert main(['replay', str(tmp_path / 'scans.mcap'), *outputs]) == 0
    frames = []
    for name in ('r.mcap', 'r.json'):
        folder = tmp_path / f'report of {name}'
        assert main(['report', str(tmp_path / name), '--out', str(folder)]) == 0
        frames.append((folder / 'frames_r.csv').read_text())
    assert frames[0] == frames[1]


def test_a_file_that_is_no_result_ends_with_1_and_makes_nothing(tmp_path, capsys):
    (tmp_path / 'none.json').write_text('{}')
    out = tmp_path / 'report'
    assert main(['report', str(tmp_path / 'none.json'), '--out', str(out)]) == 1
    assert 'none.json is no result of a replay' in capsys.readouterr().err
    assert not out.exists()


def test_a_folder_that_holds_something_ends_with_1_and_is_kept(tmp_path, capsys):
    result = write_replayed(tmp_path)
    assert main(['report', str(result), '--out', str(tmp_path)]) == 1
    assert 'is not empty' in capsys.readouterr().err
    assert sorted(file.name for file in tmp_path.iterdir()) == ['result.json', 'scans.mcap']


def test_a_result_named_twice_ends_with_2(tmp_path, capsys):
    result = str(write_replayed(tmp_path))
    assert main(['report', result, result, '--out', str(tmp_path / 'report')]) == 2
    assert 'named twice' in capsys.readouterr().err


def test_what_a_result_holds_reaches_terminal_csv_and_page_without_controls(tmp_path, capsys):
    evil = '=1+1\x1b[2J\u202e\nx'

    def change(record):
        record.update(bag=evil, notes=[evil], made_by={'parameters': {evil: evil}, evil: evil})
        for frame in record['frames']:
            frame.update({'status': evil, 'source_frame': evil, evil: 1.5, 'verdict': evil})

    result = changed(write_replayed(tmp_path, n=1), change, 'evil')
    assert main(['report', str(result), '--out', str(tmp_path / 'report')]) == 0
    assert main(['compare', str(result), str(result)]) == 1  # of too few frames
    shown = ''.join(capsys.readouterr())
    for path in (tmp_path / 'report').iterdir():
        if path.suffix in ('.html', '.csv'):
            text = path.read_text()
            assert not set('\x1b\u202e') & set(text), path
            shown += text if path.suffix == '.csv' else ''
    assert evil not in shown
    assert '\x1b' not in shown
    rows = csv.reader(io.StringIO((tmp_path / 'report' / 'frames_evil.csv').read_text()))
    cells = [each for row in rows for each in row]
    assert "'=1+1\\x1b[2J\\u202e\\nx" in cells
    assert not [each for each in cells if each.startswith('=')]
