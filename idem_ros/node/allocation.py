"""How a node takes memory from the system, so that no scan waits for it."""

import ctypes
import os

# of <malloc.h>
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8
LARGEST = 32 << 20  # [bytes] that glibc takes: larger arrays, of maps, are handed back at once
KEPT = 2 * LARGEST  # at the end of the heap, as where glibc itself has seen the largest given back

PR_SET_THP_DISABLE = 41  # of <sys/prctl.h>


def keep_freed_memory() -> None:
    """Have the process keep what it frees for the next scan; before it has other threads.

    As glibc does it by itself, one scan of 250 000 points in a few dozen spends 10 to 40 ms in a
    thousand page faults, and what a node holds creeps up by some percent within its first
    minutes. Nothing where the environment tells malloc how, or where the C library is not glibc.
    """
    is_told = any(name.startswith('MALLOC_') for name in os.environ)
    mallopt = getattr(ctypes.CDLL(None), 'mallopt', None)
    if is_told or 'malloc' in os.environ.get('GLIBC_TUNABLES', '') or mallopt is None:
        return
    # one heap: with one for each thread what a thread freed is of no use to another
    mallopt(M_ARENA_MAX, 1)
    mallopt(M_MMAP_THRESHOLD, LARGEST)
    mallopt(M_TRIM_THRESHOLD, KEPT)


def take_small_pages() -> None:
    """Have the process ask for no huge pages, where the system is Linux.

    NumPy asks for them from arrays of 4 MB on, and the system clears 2 MB for each that is touched
    first: of the first ten scans of 250 000 points seven took more than 50 ms, one 166 ms.
    """
    prctl = getattr(ctypes.CDLL(None), 'prctl', None)
    if prctl is not None:
        prctl(PR_SET_THP_DISABLE, 1, 0, 0, 0)
