"""Recordings evaluated in processes of their own; one that is killed takes no other with it."""

import logging
from collections import Counter
from concurrent.futures import FIRST_COMPLETED, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.sharedctypes import RawArray

from idem_ros.core.exceptions import IdemError
from idem_ros.evaluation.one_recording import Outcome, evaluated
from idem_ros.evaluation.worker_pool import worker_pool

RUNS = 3  # of a recording whose worker is killed: one, and two again
POLL = 0.2  # [s] between two looks at how far the workers are
BEGUN, DONE, TOTAL = range(3)
_counters = None  # in a worker: those of `_Counters`


class WorkersFailed(IdemError):
    """Worker processes that end before they begin."""


def in_processes(tasks, jobs, watch=lambda index, done, total: None):
    """Evaluate recordings in worker processes.

    When a worker is killed, the pool breaks, and nobody says which recording did it. Those that
    were under way are done again one by one, at most twice each; all others go on as before.

    Args:
        tasks: [`Task`].
        jobs: how many processes, from 1.
        watch: is told now and then how many of its messages a running task has read.

    Yields:
        (index, `Outcome`) of each task, in the order in which they end.

    Raises:
        WorkersFailed: no worker begins.
    """
    counters = RawArray('q', 3 * len(tasks))
    left, kills, idle = list(range(len(tasks))), Counter(), 0
    while left:
        together = [i for i in left if not kills[i]]
        batch, ended = together or left[:1], set()
        for index, outcome in _round(tasks, batch, jobs if together else 1, counters, watch):
            ended.add(index)
            yield index, outcome
        suspects = [i for i in batch if i not in ended and counters[3 * i + BEGUN]]
        idle = 0 if ended or suspects else idle + 1
        if idle == RUNS:
            raise WorkersFailed(f'{RUNS} times no worker process came to begin its work')
        for i in suspects:
            counters[3 * i + BEGUN] = 0
            kills[i] += 1
            if kills[i] == RUNS:
                ended.add(i)
                yield i, Outcome(tasks[i].path, reason=f'its worker was killed {RUNS} times')
            else:
                logging.warning('%s: a worker was killed; it is done again', tasks[i].path)
        left = [i for i in left if i not in ended]


def _round(tasks, indices, jobs, counters, watch):
    """Yield (index, outcome) until all are done or the pool breaks."""
    with worker_pool(min(jobs, len(indices)), _begin, counters) as pool:
        try:
            indices_of = {pool.submit(_run, i, tasks[i]): i for i in indices}
        except BrokenProcessPool:
            return
        while indices_of:
            ended, _ = wait(indices_of, POLL, FIRST_COMPLETED)
            for i in indices:
                if counters[3 * i + BEGUN]:
                    watch(i, counters[3 * i + DONE], counters[3 * i + TOTAL])
            for future in sorted(ended, key=indices_of.get):  # as the tasks are, not as a set is
                index = indices_of.pop(future)
                try:
                    yield index, future.result()
                except BrokenProcessPool:
                    continue
                except Exception as error:
                    yield index, failed(tasks[index], error)


def failed(task, error):
    """Return the `Outcome` of a task that ended by an error nobody foresaw."""
    return Outcome(task.path, reason=f'{type(error).__name__}: {" ".join(str(error).split())}')


def _begin(counters):
    global _counters
    _counters = counters


def _run(index, task):
    _counters[3 * index + BEGUN] = 1
    try:
        return evaluated(task, lambda messages, total: _counted(messages, total, 3 * index))
    finally:
        _counters[3 * index + BEGUN] = 0


def _counted(messages, total, offset):
    _counters[offset + TOTAL] = total
    for count, message in enumerate(messages, start=1):
        yield message
        _counters[offset + DONE] = count
