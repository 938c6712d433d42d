"""Worker processes that end with their parent, also when it is interrupted in their work."""

import os
import signal
import sys
import threading
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, parent_process
from multiprocessing.context import SpawnContext, SpawnProcess


class _Deaf(SpawnProcess):
    """Begins, and goes on, without hearing Ctrl-C, which is for the parent that ends us."""

    def start(self):
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
    pool = ProcessPoolExecutor(jobs, SPAWN, initializer=_begin, initargs=(begin, arguments))
    try:
        yield pool
    except BaseException:
        for child in set(active_children()) - others:
            child.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _begin(begin, arguments):
    # a parent that was killed closes no queue: who waits for its next task would wait for ever
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if begin is not None:
        begin(*arguments)


def _end_with_parent():
    if parent := parent_process():
        parent.join()
        os._exit(1)
