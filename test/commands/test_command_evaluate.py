import json
import shutil
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from recordings import scans, write_rosbag1, write_sqlite3

from idem_ros.commands import evaluate
from idem_ros.commands.main import main
from idem_ros.recording.writer import write_mcap

AGAIN = ['--voxel-size', '0.1', '--jobs', '1', '--out', 'out']


def write_drives(folder):
    """Write recordings of every kind into a folder and one within."""
    (folder / 'more').mkdir(parents=True)
    write_mcap(folder / 'a.mcap', scans(np.random.default_rng(1), n=2))
    write_sqlite3(folder / 'more' / 'b', scans(np.random.default_rng(2), n=3))
    write_rosbag1(folder / 'more' / 'c.bag', scans(np.random.default_rng(3), n=1))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working folder, with recordings of every kind."""
    monkeypatch.chdir(tmp_path)
    write_drives(tmp_path / 'drives')
    return tmp_path


@pytest.fixture(scope='module')
def evaluated(tmp_path_factory):
    """A folder with such recordings and one that cannot be read, evaluated; code and words."""
    folder, out, err = tmp_path_factory.mktemp('evaluated'), StringIO(), StringIO()
    write_drives(folder / 'drives')
    (folder / 'drives' / 'z.mcap').write_bytes(b'\x89MCAP0\r\n')
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.chdir(folder)
        code = main(['evaluate', 'drives', *AGAIN])
    return folder, (code, out.getvalue(), err.getvalue())


@pytest.fixture
def done(evaluated, tmp_path, monkeypatch):
    """The working folder, a copy of what was evaluated."""
    shutil.copytree(evaluated[0], tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def summary_of(folder):
    return json.loads((folder / 'out' / 'summary.json').read_text())


def results_in(folder):
    return {
        path.name: path.read_bytes()
        for path in sorted((folder / 'out').glob('*.json'))
        if path.name not in ('summary.json', 'evaluation.json')
    }


def test_every_recording_of_a_folder_is_evaluated(folder, capsys):
    assert main(['evaluate', 'drives', '--jobs', '2', '--out', 'out']) == 0
    captured = capsys.readouterr()
    assert [line.split()[1] for line in captured.out.splitlines()[2:6]] == [
        'drives/a.mcap',
        'drives/more/b',
        'drives/more/c.bag',
        'all',
    ]
    assert sorted(line.split(' ', 1)[1] for line in captured.err.splitlines()) == [
        'drives/a.mcap: evaluated',
        'drives/more/b: evaluated',
        'drives/more/c.bag: evaluated',
    ]
    summary = summary_of(folder)
    assert (summary['evaluated'], summary['failed'], summary['pooled']['frames']) == (3, 0, 6)
    assert [json.loads(text)['summary']['frames'] for text in results_in(folder).values()] == [
        2,
        3,
        1,
    ]


def test_a_result_is_that_of_replay(done):
    assert main(['replay', 'drives/a.mcap', '--voxel-size', '0.1', '--json', 'a.json']) == 0
    result = json.loads(Path(summary_of(done)['recordings'][0]['result']).read_text())
    expected = json.loads((done / 'a.json').read_text())
    for record in (result, expected):
        record['summary'].pop('time_ms')
        for frame in record['frames']:
            frame.pop('time_ms')
    assert result == expected


def test_what_cannot_be_read_is_named_and_the_others_go_on(evaluated):
    folder, (code, out, err) = evaluated
    assert code == 1
    assert 'not evaluated: drives/z.mcap' in out
    (line,) = (each for each in err.splitlines() if 'not evaluated' in each)
    assert line.split('] ')[1].startswith('not evaluated: drives/z.mcap')
    assert line.count('z.mcap') == 1
    summary = summary_of(folder)
    assert (summary['evaluated'], summary['failed']) == (3, 1)
    assert summary['recordings'][-1]['bag'] == 'drives/z.mcap'
    assert 'drives/z.mcap' in summary['recordings'][-1]['reason']


def test_called_again_only_what_is_missing_is_done(done, capsys):
    before = results_in(done)
    write_mcap('drives/z.mcap', scans(np.random.default_rng(4), n=1))
    assert main(['evaluate', 'drives', *AGAIN]) == 0
    lines = {line.split(' ', 1)[1] for line in capsys.readouterr().err.splitlines()}
    assert lines == {
        'drives/a.mcap: there already',
        'drives/more/b: there already',
        'drives/more/c.bag: there already',
        'drives/z.mcap: evaluated',
    }
    assert {name: results_in(done)[name] for name in before} == before
    assert summary_of(done)['pooled']['frames'] == 7


def test_a_recording_that_changed_is_evaluated_beside_its_old_result(done):
    before = results_in(done)
    write_mcap('drives/a.mcap', scans(np.random.default_rng(9), n=3))
    assert main(['evaluate', 'drives/a.mcap', *AGAIN]) == 0
    after = results_in(done)
    assert len(after) == len(before) + 1
    assert before.items() <= after.items()
    assert summary_of(done)['pooled']['frames'] == 3


def test_an_interrupted_evaluation_says_what_is_done_and_goes_on_from_there(
    folder, capsys, monkeypatch
):
    def interrupt(*_):
        raise KeyboardInterrupt

    argv = ['evaluate', 'drives', '--jobs', '1', '--out', 'out']
    monkeypatch.setattr(evaluate.Lines, 'end', interrupt)
    assert main(argv) == 130
    assert (summary_of(folder)['evaluated'], summary_of(folder)['failed']) == (1, 2)
    assert 'interrupted before it was done' in capsys.readouterr().out
    (first,) = results_in(folder).items()
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    assert main(argv) == 0
    assert first in results_in(folder).items()
    assert 'there already' in capsys.readouterr().err


def test_results_of_other_settings_are_not_mixed_with_these_or_touched(done, capsys):
    before = {path: path.read_bytes() for path in (done / 'out').iterdir()}
    for option in (['--voxel-size', '0.2'], ['--source-topic', 'source']):
        assert main(['evaluate', 'drives/a.mcap', *AGAIN, *option]) == 2
    assert 'other voxel_size' in capsys.readouterr().err
    assert {path: path.read_bytes() for path in (done / 'out').iterdir()} == before


@pytest.mark.parametrize(
    ('argv', 'code', 'message'),
    [
        (['drives', '--jobs', '0'], 2, '--jobs is 0'),
        (['nowhere'], 1, 'nowhere does not exist'),
        (['drives', '--voxel-size', '-1'], 2, 'voxel_size'),
        (['drives', '--out', 'no/where'], 1, 'no does not exist; make it first'),
        (['drives', '--out', 'drives'], 2, 'other files'),
        (['drives', '--method', 'idem,icp'], 2, 'an evaluation is of one'),
    ],
)
def test_what_cannot_begin_is_refused_in_one_line(folder, capsys, argv, code, message):
    assert main(['evaluate', *argv]) == code
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line


def test_the_same_recording_in_two_places_is_one_result(folder, capsys):
    content = (folder / 'drives' / 'a.mcap').read_bytes()
    (folder / 'drives' / 'more' / 'a.mcap').write_bytes(content)
    assert main(['evaluate', 'drives', '--jobs', '1', '--out', 'out']) == 0
    assert len(results_in(folder)) == 3
    results = [entry['result'] for entry in summary_of(folder)['recordings']]
    assert results[0] == results[1]


def test_as_a_program_without_a_folder_for_results_it_prints_the_table_and_writes_nothing(folder):
    before = sorted(folder.rglob('*'))
    argv = [sys.executable, '-m', 'idem_ros.commands.entry', 'evaluate', '--jobs', '1']
    argv += ['drives/a.mcap', 'drives']  # one of them named twice
    ended = subprocess.run(argv, capture_output=True, text=True, timeout=300, check=False)
    assert ended.returncode == 0, ended.stderr
    assert '3 of 3 recordings evaluated' in ended.stdout
    assert sorted(folder.rglob('*')) == before


def test_a_full_disk_ends_it_in_one_line_and_keeps_what_is_there(folder, capsys, monkeypatch):
    def full(self, target):
        if 'b.' in Path(target).name:
            raise OSError(28, 'No space left on device')
        return replace(self, target)

    replace = Path.replace
    argv = ['evaluate', 'drives', '--jobs', '1', '--out', 'out']
    monkeypatch.setattr(Path, 'replace', full)
    assert main(argv) == 1
    assert 'No space left on device' in capsys.readouterr().err.splitlines()[-1]
    kept = {name[:2] for name in results_in(folder)}
    assert 'a.' in kept
    assert 'b.' not in kept
    assert not list((folder / 'out').glob('.*'))


def test_bars_are_shown_on_a_terminal(monkeypatch, capsys):
    monkeypatch.setattr(sys.stderr, 'isatty', lambda: True)
    task, outcome = evaluate_task('a.mcap')
    with evaluate.Lines([task]) as lines:
        lines.watch(0, 0, 0)
        lines.watch(0, 3, 10)
        lines.end(0, outcome)
    err = capsys.readouterr().err
    assert '3/10' in err
    assert '[1/1] a.mcap: evaluated' in err


def evaluate_task(path):
    from idem_ros.evaluation.one_recording import Outcome, Task

    return Task(path, None, {}), Outcome(path, text='{}')


def test_its_help_tells_what_is_written(capsys):
    with pytest.raises(SystemExit):
        main(['evaluate', '--help'])
    out = capsys.readouterr().out
    assert evaluate.DESCRIPTION in out
    assert all(word in out for word in ('summary.json', 'evaluation.json', 'Exit code'))
