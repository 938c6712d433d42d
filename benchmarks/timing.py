"""Wall-clock times of calls that take turns, so that the machine's noise hits all alike."""

import gc
from time import perf_counter_ns

import numpy as np


def interleaved_ms(calls, rounds, seconds=0.0, most=1000):
    """Time every call once a round, the first call of a round being another each time.

    Args:
        calls: name -> function of the round's number; the first round of each only warms up.
        rounds: how many rounds, at least.
        seconds: go on for about so long.
        most: how many rounds, at most.

    Returns:
        name -> (rounds,) milliseconds.
    """
    for call in calls.values():
        call(0)
    names, times = list(calls), {name: [] for name in calls}
    until = perf_counter_ns() + 1e9 * seconds
    enabled = gc.isenabled()
    gc.disable()
    try:
        done = 0
        while done < rounds or (done < most and perf_counter_ns() < until):
            for k in range(len(names)):
                name = names[(k + done) % len(names)]
                start = perf_counter_ns()
                calls[name](done)
                times[name].append((perf_counter_ns() - start) / 1e6)
            done += 1
            gc.collect()
    finally:
        if enabled:
            gc.enable()
    return {name: np.array(values) for name, values in times.items()}


def median_and_p95(milliseconds):
    """Return {'median', 'p95', 'rounds'} of some times."""
    return {
        'median': float(np.median(milliseconds)),
        'p95': float(np.percentile(milliseconds, 95)),
        'rounds': len(milliseconds),
    }
