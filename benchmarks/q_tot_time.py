"""The time of one exact q_tot at the size of the paper's LiDAR case."""

import numpy as np

from benchmarks.case import displaced
from benchmarks.speed_cases import STAIRCASE, staircase
from benchmarks.timing import interleaved_ms, median_and_p95
from idem_ros.core import q_tot, search_radius
from idem_ros.core.metric.landscape import Landscape


def q_tot_ms(rounds, sizes=STAIRCASE):
    """Return ('points', 'radius', and what -> median_and_p95) of q_tot at a fresh pose a round."""
    rng = np.random.default_rng(0)
    target, source = staircase(rng, sizes)
    radius = search_radius(target, source)
    center = source.mean(axis=0)
    poses = [displaced(np.eye(4), center, 0.1, 0.2 * radius, rng) for _ in range(8)]
    landscape = Landscape(target, source, radius)
    calls = {
        'points only': lambda k: q_tot(target, source, poses[k % 8]),
        'points and radius': lambda k: q_tot(target, source, poses[k % 8], radius=radius),
    }
    calls['one of many poses'] = lambda k: landscape.at(poses[k % 8][None])
    times = interleaved_ms(calls, rounds)
    return {
        'points': sizes,
        'radius': radius,
        **{name: median_and_p95(ms) for name, ms in times.items()},
    }
