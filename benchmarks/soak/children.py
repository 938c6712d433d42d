"""The processes of a soak: they end with the block that started them, whatever happens in it."""

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks import CHECKOUT
from benchmarks.soak.player import PLAYS, Played
from idem_ros.core.exceptions import IdemError
from idem_ros.node.process import ended

PLAYER = [sys.executable, '-m', 'benchmarks.soak.player']


class SoakFailed(IdemError):
    """A process of the soak that did not do its part."""


@contextmanager
def started(command: list[str], **options) -> Iterator[subprocess.Popen]:
    """Yield a process that is ended with the block: asked to, then made to."""
    child = subprocess.Popen(command, **options)
    try:
        yield child
    finally:
        ended(child)
        for stream in (child.stdout, child.stderr):
            if stream:
                stream.close()


@contextmanager
def started_player(
    rate: float, seconds: float, points: int, is_moving: bool = False
) -> Iterator[subprocess.Popen]:
    """Yield a player of clouds, of sweeps in motion if that is asked for; see `SoakPlayer`."""
    values = {'--rate': rate, '--seconds': seconds, '--points': points}
    arguments = [word for name, value in values.items() for word in (name, str(value))]
    arguments += ['--moving'] * is_moving
    with started([*PLAYER, *arguments], cwd=CHECKOUT, stdout=subprocess.PIPE, text=True) as child:
        yield child


def wait_until_it_plays(player: subprocess.Popen) -> None:
    """Wait until a player has met the node.

    Raises:
        SoakFailed: it ended without.
    """
    if player.stdout.readline().strip() != PLAYS:
        raise SoakFailed(f'the player ended with exit code {player.wait()}')


def clean_shared_memory() -> None:
    """Remove what nodes that were killed left in shared memory; Fast DDS knows whose are alive."""
    command = Path(sys.executable).with_name('fastdds')
    if command.exists():
        subprocess.run([command, 'shm', 'clean'], stdout=subprocess.DEVNULL, check=False)


def played_by(
    player: subprocess.Popen, patience: float, every_second: Callable[[], None] = lambda: None
) -> Played:
    """Wait until a player has ended and return what it says.

    Args:
        player: see `started_player`.
        patience: [s] until it should have ended.
        every_second: called so often meanwhile.

    Raises:
        SoakFailed: it did not end in time, or not well.
    """
    end, printed = time.monotonic() + patience, None
    while printed is None:
        try:
            printed, _ = player.communicate(timeout=1.0)
        except subprocess.TimeoutExpired:
            every_second()
            if time.monotonic() > end:
                raise SoakFailed(f'the player did not end within {patience:.0f} s') from None
    if player.returncode != 0:
        raise SoakFailed(f'the player ended with exit code {player.returncode}')
    record = json.loads(printed.splitlines()[-1])
    for name in ('published', 'answered'):
        record[name] = {int(stamp): at for stamp, at in record[name].items()}
    return Played(**record)
