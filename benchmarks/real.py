"""IDEM beside the peers on real scans that it was not made with: errors and time in one run."""

from collections import defaultdict
from dataclasses import asdict, dataclass
from time import thread_time
from typing import NamedTuple
from zlib import crc32

import numpy as np

from benchmarks.case import displaced, errors
from benchmarks.chance import ratio_interval, sign_test
from benchmarks.methods import IDEM
from benchmarks.raw_to_result import idem_from_raw, peer_from_raw, peer_settings
from benchmarks.rings import closing
from idem_ros.core import warm_up
from idem_ros.terminal.markdown import number, table

METHODS = (IDEM, 'GICP', 'VGICP', 'PLANE_ICP')
QUICK_PAIRS = 3
PARTS = {'median': 50, 'p90': 90}
UNITS = {'rotation': 'deg', 'translation': 'mm'}
HEADER = (
    *('scans', 'starts', 'method', 'voxels [mm]', 'setting', 'right'),
    *('rotation [deg] median', 'p90', 'translation [mm] median', 'p90', 'time [ms]'),
)


NOTE = """Each pair is started from once, near and far. A peer bears the voxel size and the setting
(a correspondence distance or an edge of its voxels, in spacings) that served it best in these very
runs, an oracle that no user has; IDEM is told at every voxel size, and held against the peers at
its best. All stop at the same criteria; time is that of the CPU, one thread, raw points to result.
"IDEM over it" is what holds 95 % of the ratios over 2 000 paired resamplings of the pairs; p is
that of the exact sign test over the pairs that one of the two alone got right.
The truth is good to:
"""


NEAR = 'near'
CLOSING = """Where three scans were registered in pairs, the way over the middle one should end
where the pair of the outer two does. No truth is needed: by how much it does not is the methods'
and the scans' own. From near starts.
"""
CLOSING_HEADER = (
    *('scans', 'method', 'voxels [mm]', 'triangles'),
    *('rotation [deg] median', 'p90', 'translation [mm] median', 'p90'),
)


class Key(NamedTuple):
    """What a figure is of."""

    scans: str
    level: str
    method: str
    voxel_mm: float
    setting: str


@dataclass(frozen=True)
class Figures:
    """What came of every pair of a set from one start each, in the order of the pairs.

    Attributes:
        rotation: [deg]. translation: [mm]; of the source's centroid. time: [ms], of the CPU, raw
            points to result. right: below the limits of the set. far: how far the source's
            points lie from where they belong, on average [mm]. pairs: names of target and source.
            transforms: (4, 4) T_target_source, in the set's unit.
    """

    rotation: tuple
    translation: tuple
    time: tuple
    right: tuple
    far: tuple
    pairs: tuple = ()
    transforms: tuple = ()


def measure_sets(sets, config, quick=False, progress=lambda steps, total: steps):
    """Return {`Key`: `Figures`} of IDEM and the peers on `ScanSet`s.

    IDEM and every setting of a peer at every voxel size; all stop at the same criteria.

    Args:
        sets: of `scan_sets`.
        config: `RegistrationConfig` of IDEM, but for its voxel size.
        quick: some pairs only.
        progress: wraps the iteration over the pairs.
    """
    warm_up()
    steps = [
        (scans, pair, voxel)
        for scans in sets
        for pair in (scans.pairs[:QUICK_PAIRS] if quick else scans.pairs)
        for voxel in scans.voxel_sizes
    ]
    runs = defaultdict(list)
    for scans, (pair, build), voxel in progress(steps, len(steps)):
        case = build(voxel)
        solvers = dict(_solvers(case, config))
        for level, off in scans.starts.items():
            rng = np.random.default_rng(crc32(f'{scans.name} {pair} {level}'.encode()))
            guess = displaced(case.truth, case.centroid, *off, rng)
            for (method, setting), solve in solvers.items():
                key = Key(scans.name, level, method, 1e3 * scans.unit_m * voxel, setting)
                runs[key].append(_run(scans, case, solve, guess, pair))
    return {key: Figures(*map(tuple, zip(*of, strict=True))) for key, of in runs.items()}


def _solvers(case, config):
    yield (IDEM, ''), idem_from_raw(case, config)
    for setting in peer_settings():
        if setting.method in METHODS:
            yield (setting.method, str(setting)), peer_from_raw(case, setting, tight=True)


def _run(scans, case, solve, guess, pair):
    begin = thread_time()
    T = solve(guess)
    ms = 1e3 * (thread_time() - begin)
    rotation, translation = errors(case, T)
    right = rotation < scans.right[0] and translation < scans.right[1]
    reach = np.sqrt(np.mean(np.sum((case.source - case.centroid) ** 2, axis=1)))
    to_mm = 1e3 * scans.unit_m
    far = to_mm * float(np.hypot(translation, np.radians(rotation) * reach))
    return rotation, to_mm * translation, ms, right, far, pair, T.tolist()


def best_of(figures, scans, level, method):
    """Return the `Key` at which a method did best: fewest failures, then the least `far`."""
    keys = [key for key in figures if (key.scans, key.level, key.method) == (scans, level, method)]
    return min(keys, key=lambda key: (-sum(figures[key].right), np.median(figures[key].far)))


def real_markdown(figures, sets):
    """Return the table, and what a peer does better than IDEM at its own best.

    Args:
        figures: of `measure_sets`.
        sets: the `ScanSet`s, for how far their truth can be trusted.
    """
    rows = [
        [*key[:3], f'{key.voxel_mm:g}', key.setting, *_cells(figures[key])]
        for key in _told(figures)
    ]
    better = better_peers(figures)
    truth = ''.join(f'- {_truth(scans)}\n' for scans in sets)
    lines = ''.join(f'- {line}\n' for line in better) or 'Nothing.\n'
    text = f'{table(HEADER, rows, left=5)}\n{NOTE}\n{truth}\nA peer does better:\n\n{lines}'
    return f'{text}\n{CLOSING}\n{_closing_table(figures, sets)}'


def _closing_table(figures, sets):
    unit = {scans.name: 1e3 * scans.unit_m for scans in sets}
    rows = []
    for key in _told(figures):
        gaps = closures(figures[key])
        if gaps and key.level == NEAR:
            gaps = np.array(gaps) * (1.0, unit[key.scans])
            percentiles = np.percentile(gaps, list(PARTS.values()), axis=0).T.flat
            rows.append(
                (key.scans, key.method, f'{key.voxel_mm:g}', len(gaps), *map(number, percentiles))
            )
    return table(CLOSING_HEADER, rows, left=3)


def closures(of):
    """Return (rotation [deg], length) by which each triangle of scans fails to close.

    From scan to scan to scan, against the pair of the outer two; no truth is needed.
    """
    at = dict(zip(of.pairs, map(np.array, of.transforms), strict=True))
    return [
        closing(at[a, b], at[b, c], at[a, c])
        for a, b in at
        for other, c in at
        if other == b and (a, c) in at
    ]


def _truth(scans):
    degrees, length = scans.truth
    return f'{scans.name}: {degrees:g} deg and {1e3 * scans.unit_m * length:g} mm'


def _told(figures):
    """Yield IDEM at every voxel size, then each peer at its best."""
    for scans, level in dict.fromkeys(key[:2] for key in figures):
        yield from (key for key in figures if key[:3] == (scans, level, IDEM))
        for method in METHODS[1:]:
            yield best_of(figures, scans, level, method)


def _cells(of):
    return (
        f'{sum(of.right)}/{len(of.right)}',
        *(number(np.percentile(of.rotation, q)) for q in PARTS.values()),
        *(number(np.percentile(of.translation, q)) for q in PARTS.values()),
        number(np.median(of.time)),
    )


def better_peers(figures):
    """Return a line for each figure in which the best peer's is better than IDEM's at its best."""
    lines = []
    for scans, level in dict.fromkeys(key[:2] for key in figures):
        ours, *peers = (best_of(figures, scans, level, method) for method in METHODS)
        where = f'{scans}, {level}: '
        rights = {peer: sum(figures[peer].right) for peer in peers}
        best = max(peers, key=rights.get)
        right = sum(figures[ours].right)
        if rights[best] > right:
            p = sign_test(figures[ours].right, figures[best].right)
            lines.append(
                f'{where}right {rights[best]} ({best.method}), {right}; by chance p {p:.2f}'
            )
        for what, unit in UNITS.items():
            for part, percent in PARTS.items():
                lines += _worse(figures, ours, peers, (where, what, unit, part, percent))
        fastest = min(peers, key=lambda peer: np.median(figures[peer].time))
        times = [float(np.median(figures[key].time)) for key in (fastest, ours)]
        if times[0] < times[1]:
            lines.append(f'{where}time {times[0]:.3g} ms ({fastest.method}), {times[1]:.3g} ms')
    return lines


def _worse(figures, ours, peers, of):
    where, what, unit, part, percent = of
    each = {key: getattr(figures[key], what) for key in (ours, *peers)}
    at = {key: float(np.percentile(values, percent)) for key, values in each.items()}
    best = min(peers, key=at.get)
    if at[ours] <= at[best]:
        return []
    chance = ratio_interval(each[ours], each[best], percent)
    by_chance = f'; IDEM over it {chance[0]:.2f} to {chance[1]:.2f}' if chance else ''
    return [
        f'{where}{part} of the {what} {at[best]:.3g} {unit} ({best.method}), '
        f'{at[ours]:.3g} {unit}{by_chance}'
    ]


def real_record(figures):
    """Return every figure as what JSON holds."""
    return {'figures': [{**key._asdict(), **asdict(of)} for key, of in figures.items()]}
