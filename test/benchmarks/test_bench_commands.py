import re
import subprocess
import sys

import pytest
from conftest import ROOT

from benchmarks.commands.main import main


def test_each_benchmark_that_a_document_or_make_calls_has_help(capsys):
    texts = [path.read_text() for path in (ROOT / 'Makefile', *ROOT.glob('docs/*.md'))]
    called = {name for text in texts for name in re.findall(r'-m benchmarks (\w+)', text)}
    assert {'accuracy', 'real', 'six_dof', 'docs'} <= called
    for name in called:
        with pytest.raises(SystemExit) as ended:
            main([name, '--help'])
        assert ended.value.code == 0
        assert f'python -m benchmarks {name}' in capsys.readouterr().out


def test_who_names_no_benchmark_is_shown_which_there_are(capsys):
    assert main([]) == 2
    assert 'accuracy' in capsys.readouterr().err


def test_what_goes_beyond_the_paper_takes_a_model_as_the_paper_s_tables_do(tmp_path, capsys):
    missing, out = str(tmp_path / 'none.ply'), str(tmp_path / 'out')
    assert main(['six_dof', '--model', missing, '--out', out]) == 1
    error = capsys.readouterr().err
    assert 'none.ply' in error
    assert error.count('\n') == 1


def test_the_package_runs_in_the_checkout():
    command = [sys.executable, '-m', 'benchmarks', 'real', '--jobs']
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith('python -m benchmarks')
