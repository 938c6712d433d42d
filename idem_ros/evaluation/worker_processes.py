"""Tasks done in processes of their own; one that is killed takes no other with it."""

import logging
import os
import signal
import sys
import threading
from collections import Counter, deque
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from multiprocessing import active_children, parent_process
from multiprocessing.context import SpawnContext, SpawnProcess
from multiprocessing.sharedctypes import RawArray
from typing import Any

from idem_ros.core.exceptions import IdemError
from idem_ros.evaluation.one_recording import Outcome, evaluated
from idem_ros.terminal.interrupts import held_back
from idem_ros.terminal.printable import error_line

RUNS = 3  # of a task whose worker is killed: one, and two again
POLL = 0.2  # [s] between two looks at how far the workers are
BEGUN, DONE, TOTAL = range(3)
_counters: Any = None  # in a worker: three numbers of each task


class _Deaf(SpawnProcess):
    """Begins, and goes on, without hearing Ctrl-C, which is for the parent that ends us."""

    def start(self):
        # a child that was not yet told what it is for would say so in a traceback
        with held_back():
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                super().start()
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Spawn(SpawnContext):
    Process = _Deaf


# What removes the pool's semaphores where the process ends at once, as after Ctrl-C, would warn
# that it had to.
QUIET = 'ignore:resource_tracker'
SPAWN = _Spawn()  # a fork would copy locks that threads of numba may hold


@contextmanager
def worker_pool(jobs, begin=None, *arguments):
    """Give a pool; whoever leaves in the midst of its work leaves no process behind.

    Args:
        jobs: how many processes, from 1.
        begin: called once in each, with the arguments; importable by name.
        arguments: that can be pickled or inherited.
    """
    if QUIET not in sys.warnoptions:
        sys.warnoptions.append(QUIET)
    others = set(active_children())
    pool = ProcessPoolExecutor(jobs, SPAWN, initializer=_begin_worker, initargs=(begin, arguments))
    try:
        yield pool
    except BaseException:
        for child in set(active_children()) - others:
            child.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _begin_worker(begin, arguments):
    # a parent that was killed closes no queue: who waits for its next task would wait for ever
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if begin is not None:
        begin(*arguments)


def _end_with_parent():
    if parent := parent_process():
        parent.join()
        os._exit(1)


class WorkersFailed(IdemError):
    """Worker processes that end before they begin."""


def in_processes(tasks, jobs, watch=lambda index, done, total: None, call=evaluated):
    """Do tasks in worker processes: by default, evaluate recordings.

    A task whose worker is killed is done again by another, at most twice.

    Args:
        tasks: [`Task`], or others with a `path` that names each.
        jobs: how many processes, from 1.
        watch: is told now and then how many of its messages a running task has read.
        call: does a task, given it and `progress`, see `evaluated`; importable by name.

    Yields:
        (index, outcome) of each task, in the order in which they end: what `call` returns, or an
        `Outcome` with the reason why there is nothing.

    Raises:
        WorkersFailed: no worker begins.
    """
    counters = RawArray('q', 3 * len(tasks))
    left, running, kills = deque(range(len(tasks))), {}, Counter()
    with ExitStack() as stack:

        def new_pool():  # of one process: where it is killed, it is known over which recording
            return stack.enter_context(worker_pool(1, _begin, counters))

        idle = [new_pool() for _ in range(min(jobs, len(tasks)))]
        while left or running:
            while idle and left:
                index, pool = left.popleft(), idle.pop()
                running[pool.submit(_run, index, tasks[index], call)] = index, pool
            for future in _ended(running, counters, watch):
                index, pool = running.pop(future)
                outcome = _outcome(future, tasks[index])
                idle.append(pool if outcome else new_pool())
                kills[index] += outcome is None
                if outcome or kills[index] == RUNS:
                    yield index, outcome or _killed(tasks[index], counters[3 * index + BEGUN])
                else:
                    logging.warning('%s: a worker was killed; it is done again', tasks[index].path)
                    left.appendleft(index)


def _ended(running, counters, watch):
    """Return what has ended of {future: (index, pool)}, as the tasks are, after a while."""
    ended, _ = wait(running, POLL, FIRST_COMPLETED)
    for index, _ in running.values():
        if counters[3 * index + BEGUN]:
            watch(index, counters[3 * index + DONE], counters[3 * index + TOTAL])
    return sorted(ended, key=lambda future: running[future][0])


def _outcome(future, task):
    """Return the `Outcome` of a task; None where its worker was killed."""
    try:
        return future.result()
    except BrokenProcessPool:
        return None
    except Exception as error:
        return failed(task, error)


def _killed(task, has_begun):
    if not has_begun:
        raise WorkersFailed(f'{RUNS} times no worker process came to begin its work')
    return Outcome(task.path, reason=f'its worker was killed {RUNS} times')


def failed(task, error):
    """Return the `Outcome` of a task that ended by an error nobody foresaw."""
    return Outcome(task.path, reason=f'{type(error).__name__}: {error_line(error)}')


def _begin(counters):
    global _counters
    _counters = counters


def _run(index, task, call):
    _counters[3 * index + BEGUN] = 1
    return call(task, lambda messages, total: _counted(messages, total, 3 * index))


def _counted(messages, total, offset):
    _counters[offset + TOTAL] = total
    for count, message in enumerate(messages, start=1):
        yield message
        _counters[offset + DONE] = count
