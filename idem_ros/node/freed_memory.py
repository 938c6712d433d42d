"""Memory that a scan gave back is kept for the next one, not handed to the system each time.

As glibc does it by itself, one scan of 250 000 points in a few dozen spends 10 to 40 ms in a
thousand page faults, and what a node holds creeps up by some percent within its first minutes.
"""

import ctypes
import os

# of <malloc.h>
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8
LARGEST = 32 << 20  # [bytes] that glibc takes: larger arrays, of maps, are handed back at once
KEPT = 2 * LARGEST  # at the end of the heap, as where glibc itself has seen the largest given back


def keep_freed_memory() -> None:
    """Have the process keep what it frees; before it has other threads.

    Nothing where the environment tells malloc how, or where the C library is not glibc.
    """
    is_told = any(name.startswith('MALLOC_') for name in os.environ)
    mallopt = getattr(ctypes.CDLL(None), 'mallopt', None)
    if is_told or 'malloc' in os.environ.get('GLIBC_TUNABLES', '') or mallopt is None:
        return
    # one heap: with one for each thread what a thread freed is of no use to another
    mallopt(M_ARENA_MAX, 1)
    mallopt(M_MMAP_THRESHOLD, LARGEST)
    mallopt(M_TRIM_THRESHOLD, KEPT)
