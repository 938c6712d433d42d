import os
import subprocess
import sys
from multiprocessing import active_children
from pathlib import Path

import pytest
from deadly import NO_TOPICS, Beside, Deadly, tasks_of

from idem_ros.evaluation import worker_processes
from idem_ros.evaluation.one_recording import Task
from idem_ros.evaluation.worker_processes import WorkersFailed, in_processes


@pytest.mark.parametrize('jobs', [1, 9])
def test_every_recording_is_evaluated_once(bags, jobs):
    seen = []
    outcomes = list(in_processes(tasks_of(bags), jobs, lambda *numbers: seen.append(numbers)))
    assert sorted(index for index, _ in outcomes) == [0, 1, 2, 3]
    assert all(outcome.path == bags[index] and outcome.text for index, outcome in outcomes)
    assert all(0 <= done <= total <= 7 for _, done, total in seen)
    assert active_children() == []


def test_no_recordings_are_no_work():
    assert list(in_processes([], 2)) == []


def test_what_is_wrong_with_a_recording_is_its_outcome_and_the_others_go_on(bags):
    Path(bags[1]).write_bytes(b'\x89MCAP0\r\n')
    nobody_foresaw = Task(bags[3], None, NO_TOPICS)
    outcomes = dict(in_processes([*tasks_of(bags[:3]), nobody_foresaw], 2))
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
    outcomes = dict(in_processes(tasks, 2))
    assert [outcomes[index].reason for index in range(4)] == [
        *('', '', 'its worker was killed 3 times', '')
    ]
    assert [len(list(Path(folder).iterdir())) for folder in (marks, always)] == [2, 3]
    assert active_children() == []


def test_what_is_under_way_beside_a_worker_that_is_killed_is_not_done_again(bags, marks, tmp_path):
    begun = tmp_path / 'begun'
    begun.mkdir()
    tasks = [Beside(bags[0], str(begun), marks), Deadly(bags[1], marks, times=1)]
    assert [outcome.reason for _, outcome in in_processes(tasks, 2)] == ['', '']
    assert len(list(begun.iterdir())) == 1


def test_whoever_stops_listening_leaves_no_process(bags):
    outcomes = in_processes(tasks_of(bags), 2)
    next(outcomes)
    outcomes.close()
    assert active_children() == []


def die(_):
    os._exit(1)


def test_workers_that_never_begin_are_reported(bags, monkeypatch):
    monkeypatch.setattr(worker_processes, '_begin', die)
    with pytest.raises(WorkersFailed, match='3 times'):
        list(in_processes(tasks_of(bags), 2))


def test_a_process_that_ends_at_once_leaves_no_worker_and_no_warning():
    script = """
import os
from idem_ros.evaluation.worker_pool import worker_pool
with worker_pool(1) as pool:
    pool.submit(abs, 1).result()
    os._exit(3)
"""
    ended = subprocess.run(
        [sys.executable, '-c', script], capture_output=True, text=True, timeout=60, check=False
    )
    assert (ended.returncode, ended.stderr) == (3, '')
