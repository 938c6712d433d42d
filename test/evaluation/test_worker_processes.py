import subprocess
import sys
from multiprocessing import active_children, resource_tracker
from pathlib import Path

import pytest
from deadly import NO_TOPICS, Beside, Deadly, looked_at, tasks_of

from idem_ros.evaluation.one_recording import Task
from idem_ros.evaluation.worker_processes import WorkersFailed, in_processes


@pytest.mark.parametrize('jobs', [1, 9])
def test_every_recording_is_evaluated_once(bags, jobs):
    seen, bags = [], bags[:2]
    outcomes = list(in_processes(tasks_of(bags), jobs, lambda *numbers: seen.append(numbers)))
    assert sorted(index for index, _ in outcomes) == [0, 1]
    assert all(outcome.path == bags[index] and outcome.text for index, outcome in outcomes)
    assert all(0 <= done <= total <= 7 for _, done, total in seen)
    assert active_children() == []


def test_no_recordings_are_no_work():
    assert list(in_processes([], 2)) == []


def test_what_is_wrong_with_a_recording_is_its_outcome_and_the_others_go_on(bags):
    Path(bags[1]).write_bytes(b'\x89MCAP0\r\n')
    nobody_foresaw = Task(bags[3], None, NO_TOPICS)
    outcomes = dict(in_processes([*tasks_of(bags[:3]), nobody_foresaw], 1))
    assert [index for index in sorted(outcomes) if outcomes[index].reason] == [1, 3]
    assert bags[1] in outcomes[1].reason
    assert outcomes[3].reason.startswith('AttributeError: ')


def test_a_recording_whose_worker_is_killed_is_done_again_and_at_last_named_and_no_other(
    bags, marks, tmp_path
):
    tasks = tasks_of(bags)
    always = tmp_path / 'always'
    always.mkdir()
    tasks[1] = Deadly(bags[1], marks, times=2)
    tasks[2] = Deadly(bags[2], str(always), times=100)
    outcomes = dict(in_processes(tasks, 2, call=looked_at))
    assert [outcomes[index].reason for index in range(4)] == [
        *('', '', 'its worker was killed 3 times', '')
    ]
    assert [len(list(Path(folder).iterdir())) for folder in (marks, always)] == [2, 3]
    assert active_children() == []


def test_what_is_under_way_beside_a_worker_that_is_killed_is_not_done_again(bags, marks, tmp_path):
    begun = tmp_path / 'begun'
    begun.mkdir()
    tasks = [Beside(bags[0], str(begun), marks), Deadly(bags[1], marks, times=1)]
    outcomes = in_processes(tasks, 2, call=looked_at)
    assert [outcome.reason for _, outcome in outcomes] == ['', '']
    assert len(list(begun.iterdir())) == 1


def test_whoever_stops_listening_in_the_midst_of_the_work_leaves_no_process(bags, marks, tmp_path):
    waits = Beside(bags[1], str(tmp_path), marks)  # for what nobody does
    outcomes = in_processes([*tasks_of(bags[:1]), waits], 2, call=looked_at)
    next(outcomes)
    outcomes.close()
    assert active_children() == []


def test_workers_that_never_begin_are_reported(bags, monkeypatch):
    resource_tracker.ensure_running()  # which is a process of Python, too
    monkeypatch.setenv('PYTHONHOME', '/nowhere')
    with pytest.raises(WorkersFailed, match='3 times'):
        list(in_processes(tasks_of(bags[:1]), 1))


def test_a_process_that_ends_at_once_leaves_no_worker_and_no_warning():
    script = """
import os
from idem_ros.evaluation.worker_processes import worker_pool
with worker_pool(1) as pool:
    pool.submit(abs, 1).result()
    os._exit(3)
"""
    ended = subprocess.run(
        [sys.executable, '-c', script], capture_output=True, text=True, timeout=60, check=False
    )
    assert (ended.returncode, ended.stderr) == (3, '')


def test_a_signal_while_a_worker_is_started_leaves_no_traceback():
    script = """
import signal
from multiprocessing import util
from idem_ros.evaluation.worker_processes import worker_pool
from idem_ros.terminal import interrupts

spawn = util.spawnv_passfds

def spawned(path, arguments, descriptors):
    child = spawn(path, arguments, descriptors)
    if '--multiprocessing-fork' in arguments:  # not yet told what it is for
        signal.raise_signal(signal.SIGTERM)
    return child

if __name__ == '__main__':
    interrupts.listen()
    util.spawnv_passfds = spawned
    try:
        with worker_pool(1) as pool:
            print(pool.submit(abs, -1).result())
    except KeyboardInterrupt:
        print('ended')
"""
    command = [sys.executable, '-c', script]
    run = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert (run.stdout, run.stderr) == ('ended\n', '')
