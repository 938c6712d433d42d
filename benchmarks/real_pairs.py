"""The real pairs whose truth is trusted; they lie beside the project, and are not part of it."""

import json
from functools import cache, lru_cache
from pathlib import Path

import numpy as np

from benchmarks import CHECKOUT
from benchmarks.case import Case
from idem_ros.files.cloud_file import read_cloud

SHARED = CHECKOUT.parent / 'shared' / 'data'
ROLES = ('target', 'source')
CENTIMETRE = 0.01  # the dragon's unit, about
# folder, short name, voxel sizes [m], how far the truth may be off [deg], [m], unit [m]
TRUSTED = (
    ('stanford_bunny/data', 'bunny', (0.001, 0.002, 0.004), 0.10, 0.16e-3, 1.0),
    ('kitti_odometry_07', 'KITTI', (0.25, 0.5), 0.03, 0.02, 1.0),
    ('small_gicp', 'small_gicp', (0.25, 0.5), 0.2, 0.01, 1.0),
    ('simpleicp', 'dragon', (0.002,), 0.0, 0.0, CENTIMETRE),
)


def real_pairs():
    """Return (name, arguments of `real_case`) of every pair and voxel size; none without data."""
    if not (SHARED / 'GROUND_TRUTH.json').is_file():
        return []
    found = []
    for kind in TRUSTED:
        for number, pair in enumerate(truths()):
            if pair['item'] == kind[0]:
                between = _between(pair) if kind[1] in ('bunny', 'KITTI') else ''
                found += [
                    (f'{kind[1]}{between} {1e3 * voxel:g} mm', (number, kind, voxel))
                    for voxel in kind[2]
                ]
    return found


def real_case(name, number, kind, voxel_size):
    """Return the `Case` of one pair at one voxel size, by the arguments of `real_pairs`."""
    pair = truths()[number]
    folder, _, _, rotation_deg, translation_m, unit = kind
    target, source = (unit * _points(SHARED / folder / pair[role]) for role in ROLES)
    truth = np.array(pair['T_target_source'])
    truth[:3, 3] *= unit
    return Case(name, target, source, truth, voxel_size, rotation_deg, translation_m)


def _between(pair):
    """Say which scans: the digits that differ, ' 000-045' or ' 0-1'."""
    names = [Path(pair[role]).stem.removeprefix('bun') for role in ROLES]
    return ' ' + '-'.join(name if len(name) == 3 else str(int(name)) for name in names)


@lru_cache(4)  # the same scans come again at the next voxel size
def _points(path):
    return read_cloud(path)


@cache
def truths():
    """Return the pairs of the truth file, as they are written there."""
    return json.loads((SHARED / 'GROUND_TRUTH.json').read_text())['pairs']
