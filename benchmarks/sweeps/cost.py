"""What undoing a sweep costs, and solving its motion."""

from time import process_time

import numpy as np

from benchmarks.goal import Goal
from benchmarks.sweeps.cases import sweep
from idem_ros.core import Cloud, register, undistort

POINTS, MOST_MS, MOST_RATIO = 120_000, 3.0, 1.6
SEED = 2003  # 128 rings


def undoing_ms(runs):
    """Return the CPU time of undoing 120 000 points [ms]: the median of the runs."""
    rng = np.random.default_rng(0)
    points, times = 20.0 * rng.normal(size=(POINTS, 3)), rng.uniform(0.0, 0.1, POINTS)
    twist = np.array([10.0, 0.2, 0.1, 0.05, 0.1, 1.5])
    taken = []
    for _ in range(runs + 1):
        begin = process_time()
        undistort(points, times, twist, 'middle')
        taken.append(process_time() - begin)
    return 1e3 * float(np.median(taken[1:]))


def refinement_ms(config, runs):
    """Return CPU time [ms] of a rigid refinement and of one that solves the motion, in turns.

    Of new scans of a street against a target that stays, the verdict included.
    """
    a_sweep = sweep('street', SEED)
    target, voxel_size = Cloud(a_sweep.still.target), a_sweep.still.voxel_size
    taken = {'none': [], 'solve': []}
    for _ in range(runs + 1):
        for motion, of_motion in taken.items():
            points, times = a_sweep.still.source, None
            if motion == 'solve':
                points, times = a_sweep.points, a_sweep.times
            begin = process_time()
            source = Cloud(points, times)
            register(target, source, a_sweep.guess, config(voxel_size, motion))
            of_motion.append(process_time() - begin)
    return tuple(1e3 * float(np.median(of_motion[1:])) for of_motion in taken.values())


def goals(undoing, rigid, solving):
    """Return the `Goal`s."""
    yield Goal(f'undoing {POINTS} points on a core', undoing, MOST_MS, 'ms')
    yield Goal(
        'solving the motion, CPU time over the rigid refinement', solving / rigid, MOST_RATIO
    )
