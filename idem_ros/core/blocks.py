"""Run a kernel over blocks of points, in as many threads as are allowed.

The blocks are the same whatever the number of threads, so results are too, to the bit.
"""

from concurrent.futures import ThreadPoolExecutor
from functools import cache

BLOCK = 2048


def in_blocks(n, threads, call):
    """Return [call(begin, end), ...] over blocks of n points, in their order."""
    return in_threads(threads, lambda span: call(*span), spans(n))


def spans(n):
    """Return (begin, end) of the blocks of n points."""
    return [(begin, min(begin + BLOCK, n)) for begin in range(0, n, BLOCK)]


def in_threads(threads, call, items):
    """Return [call(item), ...]; the calls must not come back here, or they wait for themselves.

    This thread takes its share: to hand an item over costs as much as a small block.
    """
    threads = min(threads, len(items))
    if threads <= 1:
        return [call(item) for item in items]

    def share(k):
        """Return the results of the k-th thread's items."""
        return [call(item) for item in items[k::threads]]

    others = [_pool(threads - 1).submit(share, k) for k in range(1, threads)]
    results = [None] * len(items)
    results[::threads] = share(0)
    for k, other in enumerate(others, 1):
        results[k::threads] = other.result()
    return results


@cache
def _pool(threads):
    return ThreadPoolExecutor(threads, thread_name_prefix='idem_core')
