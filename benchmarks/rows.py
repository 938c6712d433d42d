"""The rows of the accuracy table: which cases each pools, and how many starts it takes."""

from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import partial

from benchmarks.conditions import CONDITIONS, condition
from benchmarks.lidar_cases import scan_to_map, scan_to_scan
from benchmarks.real_pairs import real_case, real_pairs

SEEDS = {'simulated': 20, 'condition': 100}  # cases of a row, each of which is started from once
STARTS = 20  # a level, of a row that has but one case
SCENES = {'street': (0.5, 0.25), 'room': (0.1,), 'forest': (0.5,)}
"""Scenes of the simulator and the voxel sizes they are registered at [m]; maps at the first."""
QUICK = ('street scan-scan 500 mm', 'overlap 30 %', 'similar', 'bunny 000-090 2 mm', 'KITTI 0-1 *')
QUICK_SEEDS, QUICK_STARTS = 2, 4


@dataclass(frozen=True)
class Row:
    """One row: its name, its kind and what makes its cases.

    Attributes:
        name: unique.
        kind: 'simulated', 'condition' or 'real'.
        builders: functions without arguments that return a `Case` each, picklable.
        starts: how many each case is started from, at every level.
    """

    name: str
    kind: str
    builders: tuple
    starts: int


def accuracy_rows(pattern=None, quick=False):
    """Return the rows to measure: all, or those whose name holds `pattern` (with * and ?)."""
    rows = [*_simulated(), *_conditions(), *_real()]
    if pattern:
        rows = [row for row in rows if fnmatchcase(row.name.lower(), f'*{pattern.lower()}*')]
    elif quick:
        rows = [row for row in rows if any(fnmatchcase(row.name, name) for name in QUICK)]
    return [_shortened(row) for row in rows] if quick else rows


def _simulated():
    for kind, voxel_sizes in SCENES.items():
        made = [('scan-scan', scan_to_scan, voxel_size) for voxel_size in voxel_sizes]
        made.append(('scan-map', scan_to_map, voxel_sizes[0]))
        for how, build, voxel_size in made:
            name = f'{kind} {how} {1e3 * voxel_size:g} mm'
            seeds = range(SEEDS['simulated'])
            builders = tuple(
                partial(build, f'{name} {seed}', kind, seed, voxel_size) for seed in seeds
            )
            yield Row(name, 'simulated', builders, 1)


def _conditions():
    for name in CONDITIONS:
        builders = tuple(partial(condition, name, seed) for seed in range(SEEDS['condition']))
        yield Row(name, 'condition', builders, 1)


def _real():
    for name, arguments in real_pairs():
        yield Row(name, 'real', (partial(real_case, name, *arguments),), STARTS)


def _shortened(row):
    builders = row.builders[:QUICK_SEEDS]
    return replace(row, builders=builders, starts=QUICK_STARTS // len(builders))
