"""Run a kernel over blocks of points, in as many threads, and for as long, as are allowed.

Nothing is added up across blocks whose size depends on the workers: results are the same, to the
bit, for any number of threads.
"""

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from time import perf_counter
from typing import Any, NamedTuple, TypeVar

Item = TypeVar('Item')
Result = TypeVar('Result')

BLOCK = 2048
AT_ONCE = 16  # blocks between two looks at the clock: some milliseconds
GRACE = 0.15, 0.015  # of the budget, or [s]: for a late result's verdict


class OutOfTime(Exception):
    """The deadline passed between two blocks; what they were for is not known."""


class Workers(NamedTuple):
    """How many threads share the blocks, and until when."""

    threads: int = 1
    deadline: float = math.inf  # of perf_counter [s]

    def are_late(self) -> bool:
        """Whether the deadline has passed."""
        return perf_counter() > self.deadline

    def require_time(self) -> None:
        """Go on where there is time left.

        Raises:
            OutOfTime: the deadline has passed.
        """
        if self.are_late():
            raise OutOfTime


ALONE = Workers()


def workers_of(threads: int, budget_ms: float | None) -> tuple[Workers, Workers]:
    """Return the `Workers` of a solve, and those of a late result's verdict."""
    if budget_ms is None:
        return Workers(threads), Workers(threads)
    budget = 1e-3 * budget_ms
    end = perf_counter() + budget
    share, least = GRACE
    return Workers(threads, end), Workers(threads, end + max(share * budget, least))


def in_blocks(n: int, workers: Workers, call: Callable[[int, int], Result]) -> list[Result]:
    """Return [call(begin, end), ...] over blocks of n points, in their order."""
    return in_threads(workers, lambda span: call(*span), spans(n, workers))


def spans(n: int, workers: Workers) -> list[tuple[int, int]]:
    """Return (begin, end) of the blocks of n points; one, for one worker that has no deadline."""
    block = max(n, 1) if workers == ALONE else BLOCK
    return [(begin, min(begin + block, n)) for begin in range(0, n, block)]


def shares(n: int, workers: Workers) -> int:
    """Return in how many shares the blocks of n points are dealt out: one a thread, or more.

    Where there is a deadline, a share is of a few blocks: the clock is looked at between them.
    """
    blocks = max(-(-n // BLOCK), 1)
    looks = 1 if workers.deadline == math.inf else -(-blocks // AT_ONCE)
    return max(min(workers.threads, blocks), looks)


def in_threads(
    workers: Workers, call: Callable[[Item], Result], items: Sequence[Item]
) -> list[Result]:
    """Return [call(item), ...]; the calls must not come back here, or they wait for themselves.

    This thread takes its share: to hand an item over costs as much as a small block.

    Raises:
        OutOfTime: the deadline passed before the last item.
    """
    threads = min(workers.threads, len(items))

    def share(k: int) -> list[Result]:
        """Return the results of the k-th thread's items."""
        results: list[Result] = []
        for item in items[k::threads]:
            workers.require_time()
            results.append(call(item))
        return results

    if threads <= 1:
        threads = 1
        return share(0)
    others = [_pool(threads - 1).submit(share, k) for k in range(1, threads)]
    results: list[Any] = [None] * len(items)
    try:
        results[::threads] = share(0)
    finally:
        shares = [other.exception() or other.result() for other in others]
    for k, found in enumerate(shares, 1):
        if isinstance(found, BaseException):
            raise found
        results[k::threads] = found
    return results


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix='idem_core')


os.register_at_fork(after_in_child=_pool.cache_clear)  # a child has none of its parent's threads
