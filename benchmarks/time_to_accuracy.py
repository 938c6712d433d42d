"""Error against time over voxel sizes: how long each method takes to be as good as the best."""

from dataclasses import dataclass, replace
from itertools import product
from time import perf_counter_ns

import numpy as np

from benchmarks.case import LEVELS, displacement, errors, starts, succeeded
from benchmarks.lidar_cases import scan_to_scan
from benchmarks.methods import IDEM, PEERS, Setting
from benchmarks.raw_to_result import idem_from_raw, peer_from_raw

IDEM_VOXELS = (0.25, 0.35, 0.5, 0.6, 0.75, 1.0, 1.5, 2.0, 2.5)  # [m] outdoors
PEER_VOXELS = (0.1, 0.25, 0.35, 0.5, 1.0)
START_VOXEL = 0.5  # the starts are one r4th off at this one
NEARLY = 1 / 3  # larger an error than the least
INDOORS = {'room': 0.2}  # what all of these are multiplied by


@dataclass(frozen=True)
class Tradeoff:
    """A method at one setting and voxel size: medians over all scenes."""

    method: str
    setting: str
    voxel_size: float
    milliseconds: float
    rotation_deg: float
    translation_m: float
    moved_m: float  # both in one: how far the scan's points are off, about
    success: float


@dataclass(frozen=True)
class Race:
    """What `Tradeoff`s say of one kind of scene: who is best, and how long IDEM takes to equal it.

    Attributes:
        scene: its kind.
        tradeoffs: the best of each method: those that none of its others beats in time and error.
        best_peer: the peers' `Tradeoff` of the smallest error.
        idem: the fastest of IDEM with no larger error; None: there is none.
    """

    scene: str
    tradeoffs: tuple
    best_peer: Tradeoff
    idem: Tradeoff | None

    @property
    def ratio(self):
        """IDEM's time over that of the best peer's best setting; None: IDEM is never as good."""
        return self.idem.milliseconds / self.best_peer.milliseconds if self.idem else None

    @property
    def near(self):
        """The `Race` against the fastest peer that is nearly as good as the best.

        Sixteen scenes hardly tell such errors apart, and the best may be far slower for them.
        """
        bound = (1.0 + NEARLY) * self.best_peer.moved_m
        peers = [t for t in self.tradeoffs if t.method != IDEM and t.moved_m <= bound]
        return _between(self.scene, self.tradeoffs, min(peers, key=lambda t: t.milliseconds))


def race(kind, config, seeds, progress=lambda cases: cases):
    """Return the `Race` on scans in so many scenes of a kind, a start each, single-threaded."""
    scale = INDOORS.get(kind, 1.0)
    measured = {}
    for seed in progress(range(seeds)):
        base = scan_to_scan(f'{kind} {seed}', kind, seed, scale * START_VOXEL)
        (T_guess,) = starts(base, LEVELS[0], 1)
        runs = _runs(base, config, scale)
        for run in runs.values() if seed == 0 else ():
            run(T_guess)
        for key, run in runs.items():
            start = perf_counter_ns()
            T = run(T_guess)
            milliseconds = (perf_counter_ns() - start) / 1e6
            off = errors(base, T)
            moved = base.spacing * displacement(base, *off)
            record = (milliseconds, *off, moved, succeeded(base, *off))
            measured.setdefault(key, []).append(record)
    return judged(kind, [_tradeoff(*key, records) for key, records in measured.items()])


def judged(kind, tradeoffs):
    """Return the `Race` between `Tradeoff`s."""
    best = min((t for t in tradeoffs if t.method != IDEM), key=lambda t: t.moved_m)
    return _between(kind, tuple(t for t in tradeoffs if not _beaten(t, tradeoffs)), best)


def _between(kind, tradeoffs, peer):
    equal = [t for t in tradeoffs if t.method == IDEM and t.moved_m <= peer.moved_m]
    return Race(kind, tradeoffs, peer, min(equal, key=lambda t: t.milliseconds, default=None))


def _runs(base, config, scale):
    """Return (method, setting, voxel size) -> run(T_guess)."""
    runs = {}
    for voxel_size in IDEM_VOXELS:
        case = replace(base, voxel_size=scale * voxel_size)
        runs[IDEM, '', case.voxel_size] = idem_from_raw(case, config)
    settings = [Setting(method, d) for method in PEERS[1:3] for d in (1.0, 3.0, 10.0)]
    settings += [Setting('VGICP', 10.0, edge) for edge in (0.75, 1.5, 3.0)]
    settings.append(Setting('ICP', 3.0))  # five times the error of the others, whatever it is set
    for voxel_size in PEER_VOXELS:
        case = replace(base, voxel_size=scale * voxel_size)
        for setting, tight in product(settings, (False, True)):
            name = f'{setting}{", tight" if tight else ""}'
            run = peer_from_raw(case, setting, tight=tight)
            runs[setting.method, name, case.voxel_size] = run
    return runs


def _tradeoff(method, setting, voxel_size, records):
    *medians, _ = np.median(records, axis=0)
    success = np.mean([record[-1] for record in records])
    return Tradeoff(method, setting, voxel_size, *map(float, medians), float(success))


def _beaten(tradeoff, others):
    return any(
        other.method == tradeoff.method
        and other.moved_m <= tradeoff.moved_m
        and other.milliseconds < tradeoff.milliseconds
        for other in others
    )
