import json

import pytest

from benchmarks import main_job
from benchmarks.commands.main import main
from benchmarks.goal import Goal, goals_table
from idem_ros.core import RegistrationConfig
from idem_ros.terminal.markdown import number, table


@pytest.fixture
def alone(monkeypatch):
    """The benchmark where the real pairs are not."""
    monkeypatch.setattr(main_job, 'real_pairs', lambda: [])
    monkeypatch.setattr('benchmarks.real_pairs.real_pairs', lambda: [])


def test_a_goal_is_reached_at_its_bound_and_missed_above_it_or_unmeasured():
    assert Goal('x', 1.0, 1.0).reached
    assert not Goal('x', 1.01, 1.0).reached
    assert not Goal('x', None, 1.0).reached
    assert 'MISSED' in goals_table([Goal('x', None, 1.0, 'ms')])


def test_the_main_job_is_measured_without_the_real_pairs(alone, tmp_path, capsys):
    out = tmp_path / 'main.json'
    code = main(['main', '--quick', '--json', str(out)])
    goals = json.loads(out.read_text())['goals']
    assert code == (0 if all(goal['reached'] for goal in goals) else 1)
    errors = [goal for goal in goals if goal['unit'] in ('deg', 'mm')]
    assert len(errors) == 4
    assert all(goal['reached'] for goal in errors)
    assert 'real pairs' in capsys.readouterr().out


def test_a_missed_figure_ends_with_exit_code_1(alone, monkeypatch, capsys):
    monkeypatch.setattr(main_job, 'measure', lambda *_: [Goal('x', 2.0, 1.0)])
    assert main(['main']) == 1
    assert 'MISSED' in capsys.readouterr().out


def test_the_real_pairs_are_measured_where_they_are(shared_data):
    names = [name for name, _ in main_job.real_pairs()]
    for (first, last), limits in main_job.REAL.items():
        assert [name for name in names if name.startswith(first) and name.endswith(last)]
        assert len(limits) == 4
    kitti = [p for p in main_job.real_pairs() if p[0] == 'KITTI 0-1 500 mm']
    goals = list(main_job._real('KITTI', kitti, (1.5, 0.3, 0.05, 0.03), RegistrationConfig(), 1))
    assert len(goals) == 3
    assert all(goal.reached for goal in goals)


def test_tables_are_aligned_and_escape_what_would_break_them():
    lines = table(('a', 'b|c'), [('long name', 1), ('x', None)]).splitlines()
    assert len({len(line) for line in lines}) == 1
    assert 'b\\|c' in lines[0]
    assert lines[1].startswith('| ---')
    assert lines[1].endswith('-: |')
    assert (number(None), number(0.0012345, 1e3)) == ('-', '1.23')
