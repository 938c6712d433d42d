"""Worker processes that end with their parent, also when it is interrupted in their work."""

import signal
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context

SPAWN = get_context('spawn')  # a fork would copy locks that threads of numba may hold


@contextmanager
def worker_pool(jobs, begin=None, *arguments):
    """Give a pool; whoever leaves in the midst of its work leaves no process behind.

    Args:
        jobs: how many processes, from 1.
        begin: called once in each, with the arguments; importable by name.
        arguments: that can be pickled or inherited.
    """
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
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which ends us
    if begin is not None:
        begin(*arguments)
