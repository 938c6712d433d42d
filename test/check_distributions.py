"""The sdist and the wheel in IDEM_DIST work where there is no ROS; `make wheel` runs this."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

DIST = Path(os.environ.get('IDEM_DIST', 'absent')).resolve()
PATIENCE = 600  # [s]: pip fetches, numba compiles


def run(*command, cwd, code=0):
    """Run a command without the variables of a sourced ROS; return what it printed."""
    without_ros = {
        name: value
        for name, value in os.environ.items()
        if name not in ('PYTHONPATH', 'AMENT_PREFIX_PATH', 'VIRTUAL_ENV')
    }
    done = subprocess.run(
        list(map(str, command)),
        cwd=cwd,
        env=without_ros,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == code, done.stderr
    return done.stdout + done.stderr


def test_there_is_one_sdist_and_one_wheel_of_pure_python():
    assert [file.name.split('-', 2)[2] for file in DIST.glob('*.whl')] == ['py3-none-any.whl']
    assert len(list(DIST.glob('*.tar.gz'))) == 1


@pytest.fixture(params=['*.tar.gz', '*.whl'])
def environment(request, tmp_path):
    """Return the folder of executables of an environment that has nothing but the package."""
    (file,) = DIST.glob(request.param)
    run(sys.executable, '-m', 'venv', 'clean', cwd=tmp_path)
    executables = tmp_path / 'clean' / 'bin'
    constraints = ROOT / 'constraints.txt'
    pip = executables / 'python', '-m', 'pip', 'install', '--quiet', '--constraint', constraints
    run(*pip, file, cwd=tmp_path)
    return executables


def test_a_recording_is_replayed_and_the_node_says_what_it_lacks(environment, tmp_path):
    assert run(environment / 'idem', '--version', cwd=tmp_path).startswith('idem ')
    bag = ROOT / 'bags' / 'demo.mcap'
    said = run(environment / 'idem', 'replay', bag, '--voxel-size', '0.5', cwd=tmp_path)
    assert '21 registered' in said
    said = run(environment / 'idem_node', cwd=tmp_path, code=1)
    assert 'rclpy' in said
    assert 'Traceback' not in said
    share = environment.parent / 'share' / 'idem_ros'
    shipped = {
        each.name
        for folder in ('config', 'launch')
        for each in (ROOT / folder).iterdir()
        if each.is_file()
    }
    assert shipped <= {each.name for each in share.rglob('*')}
