"""The names of this process's shared-memory ports: who loses one hears nothing any more.

A sender finds a port by its name. One that still sends to a killed process makes the port of that
process anew and removes it again, by its name, until the lease of the dead has run out (20 s); a
sender on a busy machine takes a port for dead whose owner did not turn up for a second. Either
may remove the name of a port that a living process listens at: what is in it then reaches nobody.
A second name keeps the port, and gives it its first one back.
"""

import os
import re
from contextlib import suppress
from pathlib import Path

from idem_ros.node import dead_ports

MAPPED = re.compile(r' (\d+) +\S*/fastrtps_port(\d+)(?: \(deleted\))?$', re.M)
READ = re.compile(r'/fastrtps_port(\d+)_el\b')


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
    return dead_ports.SHARED_MEMORY / f'fastrtps_port{port}'


def _second(port: int) -> Path:
    return dead_ports.SHARED_MEMORY / f'{dead_ports.SECOND_NAME}{port}_{os.getpid()}'


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
