"""Run a kernel over blocks of points, in as many threads as are allowed.

The blocks are the same whatever the number of threads, so results are too, to the bit.
"""

from concurrent.futures import ThreadPoolExecutor
from functools import cache

BLOCK = 2048


def in_blocks(n, threads, call):
    """Return [call(begin, end), ...] over blocks of n points, in their order."""
    spans = [(begin, min(begin + BLOCK, n)) for begin in range(0, n, BLOCK)]
    return in_threads(threads, lambda span: call(*span), spans)


def in_threads(threads, call, items):
    """Return [call(item), ...]; the calls must not come back here, or they wait for themselves."""
    if threads == 1 or len(items) == 1:
        return [call(item) for item in items]
    return list(_pool(threads).map(call, items))


@cache
def _pool(threads):
    return ThreadPoolExecutor(threads, thread_name_prefix='idem_core')
