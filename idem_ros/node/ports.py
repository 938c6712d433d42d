"""This process's shared-memory ports, and those that killed processes have left.

Fast DDS gives a new node the first port that nobody holds, so that of the node killed before, and
makes its segment anew. Who sent to the killed one still has the old segment open, and writes into
it until a watchdog, which looks once a second, has twice found nobody reading: 1 to 4 s.

The segment that a process sends from, 0.5 MB, or 35 MB of the large-cloud profile, is removed by
who received from it; where those were killed as well it stays until the machine starts anew, so a
node that starts removes it. A port without a lock is left alone: a sender may have it open, 60 kB
that the next process in its place takes over.

A sender finds a port by its name. One that still sends to a killed process makes the port of that
process anew and removes it again, by its name, until the lease of the dead has run out (20 s); a
sender on a busy machine takes a port for dead whose owner did not turn up for a second. Either
may remove the name of a port that a living process listens at: what is in it then reaches nobody.
A second name keeps the port, and gives it its first one back.
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
SECOND_NAME = 'idem_ros_port'  # see `OwnPorts`
MAPPED = re.compile(r' (\d+) +\S*/fastrtps_port(\d+)(?: \(deleted\))?$', re.M)
READ = re.compile(r'/fastrtps_port(\d+)_el\b')


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


class OwnPorts:
    """Keeps the names of the ports that this process listens at; nothing where it has none.

    Attributes:
        restored: how often a port got its name back.
        lost: how often running a port was found without a name that could be given back.
    """

    def __init__(self):
        self.restored = self.lost = 0
        self._kept: dict[int, int] = {}
        self.keep()

    def keep(self) -> int:
        """Give each port its name back that has lost it; return how many did.

        Ports that are new, or were made anew, are kept from now on.
        """
        ports = _read()
        if all(self._kept.get(port) == (_inode(_name(port)) or 0) for port in ports):
            self.lost = 0
            return 0
        mapped, before, lost = _mapped(), self.restored, 0
        for port in ports:
            inodes = mapped.get(port, ())
            lost += bool(inodes) and not any([self._keep_one(port, each) for each in inodes])
        # where not one name is right, names are not what they are taken for here
        self.lost = self.lost + 1 if lost and self._kept else 0
        return self.restored - before

    def close(self) -> None:
        """Remove the second names."""
        for port in self._kept:
            _second(port).unlink(missing_ok=True)
        self._kept.clear()

    def _keep_one(self, port: int, inode: int) -> bool:
        """Keep what this process sees of a port; return whether it has its name."""
        name, second = _name(port), _second(port)
        with suppress(OSError):  # it went away meanwhile, or there are no hard links
            if _inode(name) == inode:
                self._kept[port] = inode
                second.unlink(missing_ok=True)
                os.link(name, second)
            elif _inode(second) == inode:
                again = second.with_suffix('.again')
                os.link(second, again)
                again.replace(name)
                self.restored += 1
        return _inode(name) == inode


def _name(port: int) -> Path:
    return SHARED_MEMORY / f'fastrtps_port{port}'


def _second(port: int) -> Path:
    return SHARED_MEMORY / f'{SECOND_NAME}{port}_{os.getpid()}'


def _inode(file: Path) -> int | None:
    try:
        return file.stat().st_ino
    except OSError:
        return None


def _read() -> set[int]:
    """Return the ports that this process listens at: it holds their locks."""
    links = []
    for descriptor in Path('/proc/self/fd').glob('*'):
        with suppress(OSError):  # the descriptor of this very listing
            links.append(str(descriptor.readlink()))
    return {int(match[1]) for match in map(READ.search, links) if match}


def _mapped() -> dict[int, set[int]]:
    """Return {port: inodes of what this process sees of it}."""
    try:
        maps = Path('/proc/self/maps').read_text(encoding='utf-8', errors='replace')
    except OSError:
        return {}
    found: dict[int, set[int]] = {}
    for inode, port in MAPPED.findall(maps):
        found.setdefault(int(port), set()).add(int(inode))
    return found
