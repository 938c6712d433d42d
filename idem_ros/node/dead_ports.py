"""Shared-memory ports of killed processes: a node that starts does not take one over.

Fast DDS gives a new node the first port that nobody holds, so that of the node killed before, and
makes its segment anew. Who sent to the killed one still has the old segment open, and writes into
it until a watchdog, which looks once a second, has twice found nobody reading: 1 to 4 s.

The segment that a process sends from, 0.5 MB, or 35 MB of the large-cloud profile, is removed by
who received from it; where those were killed as well it stays until the machine starts anew, so a
node that starts removes it. A port without a lock is left alone: a sender may have it open, 60 kB
that the next process in its place takes over.
"""

import fcntl
import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rclpy.context import Context
from rclpy.utilities import get_default_context

SHARED_MEMORY = Path('/dev/shm')
LOCK = re.compile(r'fastrtps_port(\d+)_el')  # held by the reader of a port as long as it lives
SEGMENT = re.compile(r'fastrtps_[0-9a-f]{16}_el')  # held by who sends from it as long as it lives
NEW = 10.0  # [s] that a segment may be made in, before its lock is held
FIRST_PORT, PORTS = 7400, 250  # of domain 0, and of each domain: DDSI-RTPS 9.6.1.1
SHARED_PORTS = range(FIRST_PORT - 400, FIRST_PORT)  # of all domains: endpoints with a port each
SECOND_NAME = 'idem_ros_port'  # see `own_ports`


def domain_of(context: Context | None) -> int:
    """Return the domain of a context; None: the default one."""
    return (context or get_default_context()).get_domain_id()


@contextmanager
def no_dead_ports(domain: int) -> Iterator[None]:
    """Keep Fast DDS from giving the ports of killed processes away in the block; then remove them.

    Ports whose readers live are left alone; so is all where there is no Fast DDS. The block should
    be short: who sends to a killed process waits for its port meanwhile.

    Args:
        domain: of ROS, whose ports are meant.
    """
    first = FIRST_PORT + PORTS * domain
    meant = {*SHARED_PORTS, *range(first, first + PORTS)}
    held: dict[Path, int] = {}
    _remove_second_names()
    _remove_segments()
    for lock in SHARED_MEMORY.glob('fastrtps_port*_el'):
        match = LOCK.fullmatch(lock.name)
        if match and int(match[1]) in meant:
            with suppress(OSError):  # it is gone by now, or of another user
                _hold(lock, held)
    try:
        yield
    finally:
        _remove(held)


def _hold(lock: Path, held: dict[Path, int]) -> None:
    """Lock a file as Fast DDS does, where nobody has."""
    descriptor = os.open(lock, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
    else:
        held[lock] = descriptor


def _remove_segments() -> None:
    """Remove what killed processes sent from; who still reads there has it open."""
    dead: dict[Path, int] = {}
    for lock in SHARED_MEMORY.glob('fastrtps_*_el'):
        with suppress(OSError):  # it is gone by now, or of another user
            if SEGMENT.fullmatch(lock.name) and time.time() - lock.stat().st_mtime > NEW:
                _hold(lock, dead)
    _remove(dead)


def _remove(held: dict[Path, int]) -> None:
    """Remove files whose locks are held, and these."""
    for lock, descriptor in held.items():
        for file in (lock.with_name(lock.name.removesuffix('_el')), lock):
            with suppress(OSError):
                file.unlink()
        os.close(descriptor)


def _remove_second_names() -> None:
    for file in SHARED_MEMORY.glob(f'{SECOND_NAME}*_*'):
        if not Path('/proc', file.stem.rpartition('_')[2]).exists():
            with suppress(OSError):
                file.unlink()
