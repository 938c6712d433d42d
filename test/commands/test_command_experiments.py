import pytest

from idem_ros.commands.main import main
from idem_ros.experiments import catalogue
from idem_ros.experiments.experiment import Experiment, write_csv

pytest.importorskip('matplotlib')


@pytest.fixture
def counted(monkeypatch):
    """Two quick experiments, and the names of those that were run."""
    ran = []

    def run_as(name):
        def run(context):
            ran.append(name)
            return [write_csv(context.out / f'{name}.csv', ('seed',), [(context.seed,)])]

        return run

    records = tuple(Experiment(name, f'the {name}', run_as(name)) for name in ('one', 'two'))
    monkeypatch.setattr(catalogue, 'EXPERIMENTS', records)
    return ran


def test_list_names_every_table_and_figure(capsys):
    assert main(['experiments', 'list']) == 0
    listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert {'table1', 'table2', 'figure4', 'figure18'} <= set(listed)


def test_what_was_made_with_the_same_settings_is_kept(counted, tmp_path, capsys):
    run = ['experiments', 'run', 'all', '--out', str(tmp_path)]
    assert main([*run[:2], 'one', *run[3:]]) == 0
    assert main(run) == 0
    assert counted == ['one', 'two']
    assert 'kept from an earlier run' in capsys.readouterr().out
    assert main([*run, '--seed', '3']) == 0
    assert counted == ['one', 'two', 'one', 'two']
    (tmp_path / 'two.csv').unlink()
    assert main([*run, '--seed', '3']) == 0
    assert counted[-1] == 'two'
    assert (tmp_path / 'two.csv').read_text() == 'seed\n3\n'


def test_an_unknown_experiment_lists_those_that_exist(counted, tmp_path, capsys):
    assert main(['experiments', 'run', 'three', '--out', str(tmp_path)]) == 2
    assert "no experiment 'three'; there are one, two, and all" in capsys.readouterr().err


@pytest.mark.parametrize(
    ('options', 'said'),
    [(['--seed', '-1'], '--seed is -1'), (['--model', 'none.ply'], 'none.ply')],
)
def test_what_cannot_be_used_is_one_line(counted, tmp_path, capsys, options, said):
    assert main(['experiments', 'run', 'one', '--out', str(tmp_path / 'out'), *options]) in (1, 2)
    error = capsys.readouterr().err
    assert said in error
    assert 'Traceback' not in error
    assert not counted
