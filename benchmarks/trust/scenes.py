"""The kinds of scene that trust is measured in, and cases of each."""

from functools import partial

from benchmarks.bare_scenes import bare_case
from benchmarks.conditions import CONDITIONS, condition
from benchmarks.lidar_cases import scan_to_scan
from benchmarks.real_pairs import real_case, real_pairs
from benchmarks.trust.sensors import depth_case

LIDAR = {'street': (0.5, 0.25), 'room': (0.1,), 'forest': (0.5,)}
"""Simulated scenes and their voxel sizes [m]."""
DEPTH_VOXELS = (0.05, 0.1)  # [m], of depth cameras in furnished rooms
BOX, BOX_VOXELS = 'box in corridor', (None, 0.15)
REAL = {'bunny': 'real objects', 'dragon': 'real objects', 'KITTI': 'real LiDAR'}
REAL |= {'small_gicp': 'real LiDAR'}
FIRST_SEED = 100  # those before are the accuracy table's


def simulated(count):
    """Return {kind: builders} of `count` cases of each simulated kind, all different."""
    found = {}
    for kind, voxel_sizes in LIDAR.items():
        found[kind] = [
            partial(
                scan_to_scan, f'{kind} {seed}', kind, seed, voxel_sizes[seed % len(voxel_sizes)]
            )
            for seed in range(FIRST_SEED, FIRST_SEED + count)
        ]
    found['depth cameras'] = [
        partial(depth_case, seed, DEPTH_VOXELS[seed % len(DEPTH_VOXELS)])
        for seed in range(FIRST_SEED, FIRST_SEED + count)
    ]
    names = list(CONDITIONS)
    found['objects'] = [
        partial(condition, names[seed % len(names)], seed)
        for seed in range(FIRST_SEED, FIRST_SEED + count)
    ]
    found['corridors'] = [
        partial(bare_case, BOX, seed, BOX_VOXELS[seed % len(BOX_VOXELS)]) for seed in range(count)
    ]
    return found


def real():
    """Return {kind: builders} of the real pairs; empty where they do not lie beside it."""
    found = {}
    for name, arguments in real_pairs():
        kind = REAL[name.split()[0]]
        found.setdefault(kind, []).append(partial(real_case, name, *arguments))
    return found
