import json
import os
import signal
import subprocess
import sys
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from deadly import Deadly, looked_at, tasks_of
from drives import drive

from idem_ros.commands.main import main
from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry.se3 import inverse
from idem_ros.evaluation.cluster import ClusterMissing, on_cluster
from idem_ros.evaluation.one_recording import evaluated
from idem_ros.smoothing.joining import Pairs, joined
from idem_ros.smoothing.keyframes import KeyframeClouds

SUPPORT = Path(__file__).resolve().parents[1] / 'support'
LOOPBACK = '127.0.0.1'


@contextmanager
def cluster(folder, allowed_failures=3):
    """A scheduler and two workers, processes of their own on loopback; yields its address."""
    pytest.importorskip('distributed', reason='the extra "cluster" is not installed')
    environment = {
        **os.environ,
        'PYTHONPATH': str(SUPPORT),  # of `Deadly`
        'DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES': str(allowed_failures),
    }
    with ExitStack() as stack:

        def started(role, *arguments):
            command = [sys.executable, '-m', f'distributed.cli.dask_{role}', *arguments]
            quiet = {'stdout': subprocess.DEVNULL, 'stderr': subprocess.PIPE}
            child = subprocess.Popen(command, env=environment, cwd=folder, text=True, **quiet)
            stack.callback(ended, child)
            return child

        scheduler = started('scheduler', '--host', LOOPBACK, '--port', '0', '--no-dashboard')
        line = next(line for line in scheduler.stderr if 'Scheduler at:' in line)
        address = line.split('Scheduler at:')[1].strip()
        for i in range(2):
            options = ['--no-nanny', '--no-dashboard', '--nthreads', '1', '--host', LOOPBACK]
            started('worker', address, *options, '--local-directory', str(folder / f'worker_{i}'))
        yield address


def ended(child):
    child.send_signal(signal.SIGTERM)
    try:
        child.communicate(timeout=20)
    except subprocess.TimeoutExpired:
        child.kill()
        child.communicate(timeout=20)


@pytest.fixture(scope='module')
def address(tmp_path_factory):
    """That of a `cluster` which the tests here share; one of its workers may be lost."""
    with cluster(tmp_path_factory.mktemp('cluster')) as found:
        yield found


def without_times(text):
    record = json.loads(text)
    record['summary'].pop('time_ms')
    for frame in record['frames']:
        frame.pop('time_ms')
    return record


def test_results_are_those_of_this_process_and_a_killed_worker_loses_none(address, bags, marks):
    tasks = tasks_of(bags)
    expected = [evaluated(task) for task in tasks]
    tasks[1] = Deadly(bags[1], marks, times=1)
    Path(bags[3]).write_bytes(b'')
    found = dict(on_cluster(tasks, address, patience=60))
    assert len(list(Path(marks).iterdir())) == 1
    assert sorted(found) == [0, 1, 2, 3]
    for i in (0, 1, 2):
        assert without_times(found[i].text) == without_times(expected[i].text)
        assert found[i].identity == expected[i].identity
    assert bags[3] in found[3].reason


def test_tasks_of_another_kind_are_done_alike(address, tmp_path):
    clouds, _, odometry = drive(np.random.default_rng(0), 2)
    for k, points in enumerate(clouds):
        KeyframeClouds(tmp_path).write(k, points)
    guess = inverse(odometry[0]) @ odometry[1]
    pairs = Pairs('pair', str(tmp_path), ((0, 1),), guess[None], RegistrationConfig())
    gone = replace(pairs, folder=str(tmp_path / 'gone'))
    found = dict(on_cluster([pairs, gone], address, patience=60, call=joined))
    (there,), (here,) = found[0].relations, joined(pairs).relations
    assert there.counts
    np.testing.assert_array_equal(there.T_i_j, here.T_i_j)
    assert 'gone' in found[1].reason


def test_a_recording_whose_workers_are_killed_too_often_is_named(bags, marks, tmp_path):
    with cluster(tmp_path, allowed_failures=0) as address:
        options = {'patience': 60, 'call': looked_at}
        found = dict(on_cluster([Deadly(bags[3], marks, times=1)], address, **options))
        others = dict(on_cluster(tasks_of(bags[:1]), address, **options))
    assert found[0].reason == 'its worker was killed, 1 time'
    assert others[0].text


def test_the_command_runs_on_a_cluster(address, bags, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = [Path(bag).name for bag in bags]
    assert main(['evaluate', *names, '--cluster', address, '--out', 'out']) == 0
    summary = json.loads((tmp_path / 'out' / 'summary.json').read_text())
    assert (summary['evaluated'], summary['pooled']['frames']) == (4, 8)
    assert [entry['bag'] for entry in summary['recordings']] == bags
    assert main(['evaluate', *bags, '--jobs', '1', '--out', 'out']) == 0
    assert capsys.readouterr().err.count('there already') == 4


@pytest.mark.parametrize('address', ['nonsense', f'{LOOPBACK}:1', 'tcp://127.0.0.1:x'])
def test_no_scheduler_is_an_error_of_one_line(bags, address, capsys):
    pytest.importorskip('distributed', reason='the extra "cluster" is not installed')
    assert main(['evaluate', *bags, '--cluster', address]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert repr(address) in line
    assert 'HOST:PORT' in line


def test_without_the_extra_the_error_names_it(bags, monkeypatch):
    monkeypatch.setitem(sys.modules, 'distributed', None)
    with pytest.raises(ClusterMissing, match=r'\.\[cluster\]'):
        list(on_cluster(tasks_of(bags), f'{LOOPBACK}:1'))


def test_jobs_and_a_cluster_exclude_each_other(bags, capsys):
    with pytest.raises(SystemExit, match='2'):
        main(['evaluate', *bags, '--jobs', '2', '--cluster', f'{LOOPBACK}:1'])
    assert 'not allowed with' in capsys.readouterr().err


def test_a_scheduler_without_workers_is_told(bags, monkeypatch):
    distributed = pytest.importorskip('distributed', reason='the extra "cluster" is missing')
    options = {'processes': False, 'n_workers': 0, 'dashboard_address': None}
    with (
        distributed.LocalCluster(protocol='tcp', host=LOOPBACK, **options) as local,
        pytest.raises(ClusterMissing, match='no workers'),
    ):
        list(on_cluster([*tasks_of(bags)], local.scheduler_address, patience=1))
