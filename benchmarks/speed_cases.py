"""What is timed: scans of growing density, the real pairs, and the paper's staircase."""

from fnmatch import fnmatchcase
from functools import partial

import numpy as np

from benchmarks.case import Case
from benchmarks.lidar_cases import scan_to_scan
from benchmarks.real_pairs import real_case, real_pairs
from idem_ros.simulation.lidar import Lidar

# points -> rings and steps of a sensor that sees a few more in a street
DENSITIES = {
    5_000: (16, 400),
    15_000: (32, 600),
    50_000: (64, 1000),
    120_000: (64, 2300),
    500_000: (128, 4800),
}
VOXEL_SIZES = {5_000: (0.5,), 15_000: (0.5,)}
FINE = (0.5, 0.25)  # [m], where there are points enough for both
REAL = ('bunny * 2 mm', 'KITTI *', 'small_gicp *', 'dragon *')
STAIRCASE = (34_101, 16_101)
STEP, STEPS = (0.3, 0.17), 28  # [m] depth and height
WIDTH = 40.0  # [m], which makes the search radius the paper's 0.14 m
NOISE = 0.004  # [m]


def speed_rows(quick=False):
    """Return name -> function without arguments that returns the row's `Case`."""
    rows = {}
    for points in list(DENSITIES)[: 3 if quick else None]:
        for voxel_size in VOXEL_SIZES.get(points, FINE[: 1 if quick else None]):
            name = f'street {points // 1000} k, {1e3 * voxel_size:g} mm'
            rows[name] = partial(dense_street, name, points, voxel_size)
    chosen = [pair for pair in real_pairs() if any(fnmatchcase(pair[0], name) for name in REAL)]
    for name, arguments in chosen[:: 6 if quick else 1]:
        rows[name] = partial(real_case, name, *arguments)
    return rows


def dense_street(name, points, voxel_size):
    """Return the `Case` of two scans of one street with exactly so many points."""
    rings, steps = DENSITIES[points]
    lidar = Lidar(rings=rings, azimuth_steps=steps)
    case = scan_to_scan(name, 'street', 0, voxel_size, lidar)
    rng = np.random.default_rng(points)
    return Case(
        name,
        *(_thinned(cloud, points, rng) for cloud in (case.target, case.source)),
        case.truth,
        voxel_size,
    )


def staircase(rng, sizes=STAIRCASE):
    """Return two independent samplings of a staircase before a wall, overlapping by half."""
    target, source = (_stairs(rng, 2 * size) for size in sizes)
    # Parallel cuts across the stairs; each keeps two thirds, and half of what it keeps is shared.
    target, source = target[target[:, 1] < WIDTH / 6], source[source[:, 1] > -WIDTH / 6]
    return _thinned(target, sizes[0], rng), _thinned(source, sizes[1], rng)


def _stairs(rng, count):
    depth, height = STEP
    along = rng.uniform(0.0, STEPS * (depth + height), count)
    step, within = np.divmod(along, depth + height)
    x = step * depth + np.maximum(within - height, 0.0)
    z = step * height + np.minimum(within, height)
    points = np.column_stack([x, rng.uniform(-WIDTH / 2, WIDTH / 2, count), z])
    return points + rng.normal(0.0, NOISE, points.shape)


def _thinned(points, count, rng):
    """Keep `count` points, in their order, as a sensor would deliver them."""
    return points[np.sort(rng.choice(len(points), count, replace=False))]
