import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from idem_ros.results.gate import read_rules

EXAMPLES = Path(__file__).resolve().parents[2] / 'examples'
DEMO = EXAMPLES.parent / 'bags' / 'demo.mcap'


@pytest.fixture
def said_by(monkeypatch, capsys):
    """Runs an example in this process, with arguments; returns what it prints."""

    def said_by(name, *arguments):
        monkeypatch.setattr(sys, 'argv', [name, *map(str, arguments)])
        runpy.run_path(str(EXAMPLES / name), run_name='__main__')
        return capsys.readouterr().out

    return said_by


def test_an_example_runs_alone():
    command = [sys.executable, EXAMPLES / 'arrays.py']
    ended = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0, ended.stderr


def test_arrays_are_registered_to_a_millimetre(said_by):
    said = said_by('arrays.py')
    assert 'verdict: aligned' in said
    off = re.search(r'off by \[mm\]: (.*)', said)[1]
    assert max(abs(float(word)) for word in off.split()) < 1.0


def test_every_frame_of_a_recording_is_shown_with_its_verdict(said_by):
    lines = said_by('recording.py', DEMO).splitlines()
    assert len(lines) > 10
    assert all(
        re.fullmatch(r'\d+: \w+, overlap [01]\.\d\d, off by \d+\.\d mm', line) for line in lines
    )


def test_a_fast_drive_is_far_nearer_the_truth_where_its_motion_is_solved_for(said_by):
    said = said_by('sweeps.py', DEMO.with_name('fast.mcap'))
    off = {name: float(mm) for name, mm in re.findall(r'motion (\w+): ([\d.]+) mm off', said)}
    assert off['solve'] < 10.0 < 400.0 < off['none']
    speed = re.search(r'the last sweep: ([\d.]+) m/s', said)[1]
    assert abs(float(speed) - 15.0) < 0.5


def test_a_graph_of_our_edges_is_far_nearer_the_truth_than_the_odometry(said_by):
    said = said_by('pose_graph.py')
    off = {
        name: float(mm)
        for name, mm in re.findall(r'^(\w+): off by ([\d.]+) mm', said, re.MULTILINE)
    }
    assert off['graph'] < off['odometry'] / 20


def test_scans_registered_at_once_are_nearer_the_truth_than_one_to_the_next(said_by, tmp_path):
    said = said_by('several_clouds.py', tmp_path / 'both.png')
    off = dict(re.findall(r'^(.*): off by ([\d.]+) deg', said, re.MULTILINE))
    assert float(off['at once']) < 0.7 * float(off['one to the next'])
    assert (tmp_path / 'both.png').stat().st_size > 10_000


def test_the_evaluation_in_ci_calls_commands_that_there_are_with_rules_that_can_be_read():
    from idem_ros.commands.main import command_line

    (job,) = yaml.safe_load((EXAMPLES / 'gate.yml').read_text())['jobs'].values()
    words = [step['run'].split() for step in job['steps'] if 'run' in step]
    for command in (each[1:] for each in words if each[0] == 'idem'):
        command_line().parse_args(command)
    assert read_rules(EXAMPLES / 'gate_rules.yaml')


@pytest.mark.parametrize('name', ['recording.py', 'sweeps.py'])
def test_an_example_that_needs_a_recording_says_so_in_a_line(name, said_by, capsys):
    with pytest.raises(SystemExit) as ended:
        said_by(name)
    assert ended.value.code == 2
    assert 'the following arguments are required: recording' in capsys.readouterr().err


@pytest.mark.parametrize('path', sorted(EXAMPLES.glob('*.py')), ids=lambda path: path.name)
def test_each_example_says_how_it_is_run(path):
    assert f'python examples/{path.name}' in path.read_text().split('"""')[1]
