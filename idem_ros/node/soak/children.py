"""The processes of a soak: they end with the block that started them, whatever happens in it."""

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from idem_ros.core.exceptions import IdemError
from idem_ros.node.soak.player import PLAYS, Played

NODE = [sys.executable, '-m', 'idem_ros.node.registration_node']
PLAYER = [sys.executable, '-m', 'idem_ros.node.soak.player']
END_PATIENCE = 10.0  # [s]


class SoakFailed(IdemError):
    """A process of the soak that did not do its part."""


@contextmanager
def started(command: list[str], **options) -> Iterator[subprocess.Popen]:
    """Yield a process that is ended with the block: asked to, then made to."""
    process = subprocess.Popen(command, **options)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
            try:
                process.wait(END_PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
        process.wait()
        for stream in (process.stdout, process.stderr):
            if stream:
                stream.close()


def node_command(parameters: dict, log_level: str = 'error') -> list[str]:
    """Return the command of a node with parameters."""
    command = [*NODE, '--ros-args', '--log-level', f'idem_node:={log_level}']
    for name, value in parameters.items():
        command += ['-p', f'{name}:={json.dumps(value)}']
    return command


@contextmanager
def started_player(rate: float, seconds: float, points: int) -> Iterator[subprocess.Popen]:
    """Yield a player of clouds; see `SoakPlayer`."""
    values = {'--rate': rate, '--seconds': seconds, '--points': points}
    arguments = [word for name, value in values.items() for word in (name, str(value))]
    with started([*PLAYER, *arguments], stdout=subprocess.PIPE, text=True) as process:
        yield process


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
