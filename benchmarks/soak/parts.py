"""The parts of a soak: what each has a node do, and the figures it holds it to."""

import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.goal import Goal
from benchmarks.soak.children import (
    SoakFailed,
    clean_shared_memory,
    played_by,
    started,
    started_player,
    wait_until_it_plays,
)
from benchmarks.soak.footprint import Footprint, Sample
from benchmarks.soak.player import END, START_PATIENCE, Played
from idem_ros.node.process import node_command

PARAMETERS = {'voxel_size': 0.5, 'reliability': 'reliable', 'depth': 10}
RATE, OVERLOAD_RATE = 10.0, 50.0  # [1/s]
FIRST_MINUTE = 60.0  # [s]
AVERAGED = 10  # samples, one a second
LATENCY_MS, OVERLOAD_LATENCY_MS = 100.0, 300.0
FAST_RATE, FAST_LATENCY_MS = 20.0, 50.0
GROWTH_PERCENT = 2.0
RESTART_S = 1.0  # at once; see node/ports, short_lease and the large-cloud profile
COUNTS = ('received', 'answered', 'refused', 'dropped')
PLAYER_SLACK = START_PATIENCE + 60.0  # [s] a player takes longer than it plays, at most


@dataclass(frozen=True)
class Size:
    """How much a soak asks for; `is_judged_by_the_clock` is false where it is a test."""

    points: int = 120_000
    fast_points: int = 250_000
    fast_s: float = 60.0
    long_s: float = 600.0
    moving_s: float = 60.0
    overload_s: float = 30.0
    before_kill_s: float = 3.0
    kills: int = 10
    flood_s: float = 3600.0
    is_judged_by_the_clock: bool = True


QUICK = Size(6_000, 12_000, 2.0, 2.0, 2.0, 2.0, 1.0, 1, 3.0, is_judged_by_the_clock=False)


@dataclass
class Part:
    """What came of a part."""

    title: str
    goals: list[Goal] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def hold_by_the_clock(self, size: Size, goal: Goal) -> None:
        """Judge a figure that depends on the machine, or note it where that is not asked for."""
        if size.is_judged_by_the_clock:
            self.goals.append(goal)
        else:
            self.notes.append(f'{goal.figure}: {goal.measured:.4g} {goal.unit}')


def long_run(size: Size) -> Part:
    """Clouds on both topics at 10 Hz for minutes: latency, completeness, footprint."""
    part = Part(f'{size.points} points on both topics at {RATE:g} Hz for {size.long_s:g} s')
    played, samples = run_a_node(part, size.points, RATE, size.long_s)
    part.goals += _counted(played)
    never = len(played.published) - int(played.load['received'])
    part.goals.append(Goal('sources that never arrived', never, 0))
    _hold_latency(part, size, played, LATENCY_MS)
    after = [each for each in samples if each.time > FIRST_MINUTE]
    if len(after) > 2 * AVERAGED:
        _hold_footprint(part, after)
    return part


def fast_run(size: Size) -> Part:
    """Larger clouds at twice the rate: latency and completeness."""
    points, rate = size.fast_points, FAST_RATE
    part = Part(f'{points} points on both topics at {rate:g} Hz for {size.fast_s:g} s')
    played, _ = run_a_node(part, points, rate, size.fast_s)
    part.goals += _counted(played)
    _hold_latency(part, size, played, FAST_LATENCY_MS)
    return part


def moving_run(size: Size) -> Part:
    """Sweeps of a fast drive at 10 Hz, their motion solved for: latency and completeness."""
    part = Part(f'{size.points} points on both topics at {RATE:g} Hz, motion: solve')
    played, _ = run_a_node(part, size.points, RATE, size.moving_s, {'motion': 'solve'})
    part.goals += _counted(played)
    left = len(played.answered) - played.undone
    part.goals.append(Goal('answers whose motion is not told', left, 0))
    _hold_latency(part, size, played, LATENCY_MS)
    return part


def overload(size: Size) -> Part:
    """Five times what the node can take: the newest wins, and every source is counted."""
    rate = OVERLOAD_RATE
    part = Part(f'{size.points} points on both topics at {rate:g} Hz for {size.overload_s:g} s')
    played, _ = run_a_node(part, size.points, rate, size.overload_s)
    part.goals += _counted(played)
    answered = list(played.answered)
    out_of_order = int((np.diff(answered) <= 0).sum())
    part.goals.append(Goal('answers older than one before', out_of_order, 0))
    last = max(played.published)
    part.goals.append(Goal('newest source not answered', int(last not in played.answered), 0))
    _hold_latency(part, size, played, OVERLOAD_LATENCY_MS)
    return part


def killed(size: Size) -> Part:
    """SIGKILL while clouds stream in, again and again: each next node answers at once."""
    part = Part(f'killed with SIGKILL and started again, {size.kills} times')
    seconds = (size.kills + 1) * (size.before_kill_s + START_PATIENCE)  # it is told to end before
    kills, readies, starts = [], [], []
    with started_player(RATE, seconds, size.points) as player:
        for _ in range(size.kills):
            with _ready_node(starts) as node:
                readies.append(time.monotonic_ns())
                if not kills:
                    wait_until_it_plays(player)
                time.sleep(size.before_kill_s)
                node.kill()
                kills.append(time.monotonic_ns())
        with _ready_node(starts):
            readies.append(time.monotonic_ns())
            time.sleep(size.before_kill_s)
            player.send_signal(END)
            played = played_by(player, PLAYER_SLACK)
    clean_shared_memory()
    part.notes.append(f'from its start to "ready": {_listed(starts)} s')
    _hold_restarts(part, size, played, kills, readies)
    return part


def kept(size: Size) -> Part:
    """A capsule of every source: the latency over that without capsules."""
    part = Part(f'{size.points} points on both topics at {RATE:g} Hz, without and with capsules')
    p99 = []
    with TemporaryDirectory() as folder:
        for more in ({}, {'capsules.folder': folder, 'capsules.when': 'all'}):
            played, _ = run_a_node(part, size.points, RATE, size.moving_s, more)
            part.goals += _counted(played)
            p99.append(float(np.percentile(latencies(played), 99)))
        part.notes.append(f'{len(list(Path(folder).glob("*.mcap")))} capsules')
    part.notes.append(f'p99 from publication to transform: {p99[0]:.1f}, {p99[1]:.1f} ms')
    part.hold_by_the_clock(size, Goal('p99 with capsules over that without', p99[1] / p99[0], 1.1))
    return part


def _hold_restarts(
    part: Part, size: Size, played: Played, kills: list[int], readies: list[int]
) -> None:
    """Judge the lives of nodes that were ready and killed at those times [ns]."""
    ends = [*kills, float('inf')]
    answers = [
        [at for at in played.answered.values() if begin < at < end]
        for begin, end in zip([0, *kills], ends, strict=True)
    ]
    silent = sum(not each for each in answers)
    part.goals.append(Goal('nodes that answered nothing', silent, 0))
    waits = [
        max((min(each) - ready) / 1e9, 0.0)
        for each, ready in zip(answers[1:], readies[1:], strict=True)
        if each
    ]
    part.notes.append(f'from "ready" to the first transform: {_listed(waits)} s')
    goal = Goal('from "ready" to the first transform', max(waits, default=0.0), RESTART_S, 's')
    part.hold_by_the_clock(size, goal)


def run_a_node(
    part: Part, points: int, rate: float, seconds: float, more: dict[str, Any] | None = None
) -> tuple[Played, list[Sample]]:
    """Play to a node of its own; return what was played and samples of the node.

    more: parameters of the node; with `motion` the clouds are of a sensor that moves.
    """
    more = more or {}
    with (
        started(node_command({**PARAMETERS, **more})) as node,
        started_player(rate, seconds, points, 'motion' in more) as player,
    ):
        footprints = {'node': Footprint(node.pid), 'player': Footprint(player.pid)}

        def sample():
            if node.poll() is not None:
                raise SoakFailed(f'the node ended with exit code {node.returncode}')
            for each in footprints.values():
                each.sample()

        played = played_by(player, seconds + PLAYER_SLACK, sample)
    if not played.answered:
        raise SoakFailed('the node answered nothing')
    counts = ', '.join(f'{played.load[name]} {name}' for name in COUNTS)
    part.notes += [
        *(f'{name}: {each.line()}' for name, each in footprints.items()),
        f'{len(played.published)} published, {counts}; the player was late by '
        f'{played.late_ms:.0f} ms at most',
    ]
    return played, footprints['node'].samples


def _counted(played: Played) -> list[Goal]:
    unheard = int(played.load['answered']) - len(played.answered)
    return [
        Goal('|received - answered - refused - dropped|', abs(played.unsettled), 0),
        Goal('refused', int(played.load['refused']), 0),
        Goal('answers that never arrived', abs(unheard), 0),
    ]


def latencies(played: Played) -> list[float]:
    """Return how long the answer to each source took [ms]."""
    known = [stamp for stamp in played.answered if stamp in played.published]
    return [(played.answered[stamp] - played.published[stamp]) / 1e6 for stamp in known]


def _hold_latency(part: Part, size: Size, played: Played, at_most: float) -> None:
    ms = latencies(played)
    part.notes.append(f'latency: median {np.median(ms):.1f} ms, most {max(ms):.1f} ms')
    p99 = float(np.percentile(ms, 99))
    goal = Goal('p99 from publication to transform', p99, at_most, 'ms')
    part.hold_by_the_clock(size, goal)


def _hold_footprint(part: Part, after: list[Sample]) -> None:
    """Compare the end of a run with the end of its first minute."""
    rss = np.array([each.rss for each in after], dtype=float)
    growth = 100 * (rss[-AVERAGED:].mean() / rss[:AVERAGED].mean() - 1)
    part.goals.append(Goal('growth of the memory', float(growth), GROWTH_PERCENT, '%'))
    for name in ('threads', 'open_files'):
        spread = int(np.ptp([getattr(each, name) for each in after]))
        part.goals.append(Goal(f'{name.replace("_", " ")} that came or went', spread, 0))


PARTS = {each.__name__: each for each in (long_run, fast_run, moving_run, overload, killed)}


@contextmanager
def _ready_node(starts: list[float]) -> Iterator[subprocess.Popen]:
    """Yield a node that listens, and append how long that took [s]."""
    start = time.monotonic()
    with started(node_command(PARAMETERS, 'info'), stderr=subprocess.PIPE, text=True) as node:
        for line in node.stderr:
            if 'ready' in line:
                break
        else:
            raise SoakFailed(f'the node ended with exit code {node.wait()}')
        starts.append(time.monotonic() - start)
        yield node


def _listed(values: list[float]) -> str:
    return ', '.join(f'{value:.2f}' for value in values)
