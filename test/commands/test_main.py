import io
import re
import subprocess
import sys

import pytest
from conftest import ROOT

from idem_ros.commands import main as module
from idem_ros.commands.main import COMMANDS, main
from idem_ros.core import IdemError
from idem_ros.terminal.command_line import UsageError


def ends_with(error, monkeypatch):
    def fail(args):
        raise error

    monkeypatch.setattr(module.register, 'run', fail)
    return main(['register', 'a.ply', 'b.ply'])


@pytest.mark.parametrize(
    ('error', 'code', 'words'),
    [
        (IdemError('scan.ply is empty'), 1, 'error: scan.ply is empty'),
        (UsageError('give one guess each'), 2, 'error: give one guess each'),
        (KeyboardInterrupt(), 130, 'interrupted'),
    ],
)
def test_what_a_user_did_is_one_line_and_a_code(monkeypatch, capsys, error, code, words):
    assert ends_with(error, monkeypatch) == code
    (line,) = capsys.readouterr().err.splitlines()
    assert words in line


def test_a_mistake_of_ours_is_not_hidden(monkeypatch):
    with pytest.raises(ZeroDivisionError):
        ends_with(ZeroDivisionError(), monkeypatch)


@pytest.mark.parametrize(
    'argv', [['regster'], ['register', 'a.ply'], ['register', 'a', 'b', '--voxel', 'x'], ['--bug']]
)
def test_a_wrong_command_line_is_one_line_and_code_2(capsys, argv):
    with pytest.raises(SystemExit) as ended:
        main(argv)
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith('idem')
    assert error.count('\n') == 1


@pytest.mark.parametrize(
    ('argv', 'name', 'said'),
    [
        (
            ['register', 'a', 'b', '--voxelsize', '0.5'],
            'idem register',
            '--voxelsize (did you mean --voxel-size? ',
        ),
        (
            ['replay', 'a.mcap', '--sequenc=scan', '--tmu=x'],
            'idem replay',
            '--tmu (did you mean --tum? ',
        ),
        (['register', 'a', 'b', 'c'], 'idem register', 'unrecognized c ('),
        (
            ['experiments', 'run', 'table1', '--ouy', 'x'],
            'idem experiments run',
            '(did you mean --out? ',
        ),
        (['repaly', 'a.mcap'], 'idem', '(did you mean replay? '),
        (['--versoin'], 'idem', '(did you mean --version? '),
        (['register', 'a', 'b', '--xyz'], 'idem register', 'unrecognized --xyz ('),
    ],
)
def test_who_misspells_is_told_what_is_meant_by_the_command_it_was_said_to(
    capsys, argv, name, said
):
    with pytest.raises(SystemExit) as ended:
        main(argv)
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith(f'{name}: error: ')
    assert said in error
    assert error.endswith(f'see {name} --help)\n')


@pytest.mark.parametrize('argv', [[], ['experiments']])
def test_who_names_no_command_is_shown_the_help_on_stderr_and_code_2(capsys, argv):
    assert main(argv) == 2
    out, shown = capsys.readouterr()
    assert out == ''
    with pytest.raises(SystemExit):
        main([*argv, '--help'])
    assert shown == capsys.readouterr().out


@pytest.mark.parametrize(
    ('argv', 'instead'),
    [
        (['bench', 'accuracy', '--quick'], 'python -m benchmarks'),
        (['docs', '--check'], 'make docs'),
    ],
)
def test_who_still_calls_a_command_that_left_is_told_in_one_line_where_to(capsys, argv, instead):
    with pytest.raises(SystemExit) as ended:
        main(argv)
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert f'`{instead}`' in error
    assert error.count('\n') == 1


def test_help_waits_for_no_heavy_library():
    code = 'import sys, idem_ros.commands.main; print(*sys.modules)'
    done = subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert not {'rclpy', 'numba', 'rosbags', 'pandas'} & set(done.stdout.split())


@pytest.mark.parametrize('command', COMMANDS)
def test_every_command_has_help(capsys, command):
    name = command.__name__.rpartition('.')[2]
    with pytest.raises(SystemExit) as ended:
        main([name, '--help'])
    assert ended.value.code == 0
    assert f'idem {name}' in capsys.readouterr().out


def test_a_reader_that_goes_away_leaves_no_traceback():
    script = (
        'import sys; from idem_ros.commands import main as module;'
        'module.register.run = lambda args: print("x" * 2**20);'
        'sys.exit(module.main(["register", "a", "b"]))'
    )
    run = subprocess.Popen(
        [sys.executable, '-c', script], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    run.stdout.read(1)
    run.stdout.close()
    error = run.stderr.read()
    run.stderr.close()
    assert run.wait() == 1
    assert error == b''


def test_the_version_is_the_packages(capsys):
    with pytest.raises(SystemExit) as ended:
        main(['--version'])
    assert ended.value.code == 0
    version = re.search('<version>(.*)</version>', (ROOT / 'package.xml').read_text()).group(1)
    assert capsys.readouterr().out == f'idem {version}\n'


def test_a_name_that_no_encoding_holds_is_printed_all_the_same(monkeypatch):
    out = io.TextIOWrapper(io.BytesIO(), encoding='ascii')
    monkeypatch.setattr(sys, 'stdout', out)
    monkeypatch.setattr(module.register, 'run', lambda args: print(args.target) or 0)
    assert main(['register', 'sc\udcffn.ply', 'b.ply']) == 0
    assert out.buffer.getvalue() == b'sc\\udcffn.ply\n'


def test_a_full_disk_is_one_line(monkeypatch, capsys):
    assert ends_with(OSError(28, 'No space left on device'), monkeypatch) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert 'No space left on device' in line


@pytest.mark.parametrize(
    'argv',
    [
        ['register', '', 'b.ply'],
        ['register', 'a.ply', 'b.ply', '--out', ''],
        ['replay', 'a.mcap', '--json', ''],
        ['replay', 'a.mcap', '--source-topic', ''],
        ['gate', 'a.json', '', '--rules', 'r.yaml'],
        ['evaluate', 'a.mcap', '--out='],
    ],
)
def test_an_empty_text_names_nothing(capsys, argv):
    with pytest.raises(SystemExit) as ended:
        main(argv)
    assert ended.value.code == 2
    assert 'empty text' in capsys.readouterr().err
