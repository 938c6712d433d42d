"""The main job's figures: the demo's recording, real pairs from small errors, one refinement."""

from dataclasses import replace

import numpy as np

from benchmarks.case import displaced, errors
from benchmarks.goal import Goal
from benchmarks.real_pairs import real_case, real_pairs
from benchmarks.speed_cases import dense_street
from benchmarks.timing import interleaved_ms
from idem_ros.core import IdemError, register, warm_up
from idem_ros.files.installed_file import installed_file
from idem_ros.pairing.guesses import Guess
from idem_ros.pairing.pair import Pair
from idem_ros.recording.messages import cloud_message
from idem_ros.refinement.refiner import Refiner
from idem_ros.replay.run import replay

DEMO, DEMO_VOXEL = 'bags/demo.mcap', 0.5
SEEDS = 20
# what the pairs' names begin and end with; starts off by [deg], [m]; to be within [deg], [m]
REAL = {
    ('KITTI', '500 mm'): (1.5, 0.3, 0.05, 0.03),
    ('bunny', ' 2 mm'): (2.0, 0.002, 0.15, 0.0003),
}
LIVE_POINTS, LIVE_ROUNDS = 7000, 25


class DemoMissing(IdemError):
    """The demo's recording is not where it was installed or checked out."""


def measure(config, quick=False, progress=lambda steps: steps):
    """Return the `Goal`s of the main job; real pairs only where they lie beside the project."""
    warm_up()
    seeds = 3 if quick else SEEDS
    steps = [lambda: _demo(config)]
    for (first, last), limits in REAL.items():
        pairs = [p for p in real_pairs() if p[0].startswith(first) and p[0].endswith(last)]
        if pairs:
            steps.append(lambda f=first, p=pairs, lim=limits: _real(f, p, lim, config, seeds))
    steps.append(lambda: [_live(config, 5 if quick else LIVE_ROUNDS)])
    return [found for step in progress(steps) for found in step()]


def _demo(config):
    path = installed_file(DEMO)
    if path is None:
        raise DemoMissing(f'{DEMO} is not here; it lies in the checkout')
    frames = replay(path, replace(config, voxel_size=DEMO_VOXEL)).frames
    after = np.array(
        [(e.rotation_deg, e.translation_m) for e in (f.error_after() for f in frames)]
    )
    limits = ((50, 'median', 0.05, 15.0), (90, 'p90', 0.15, 30.0))
    for percent, name, degrees, millimetres in limits:
        rotation, translation = np.percentile(after, percent, axis=0)
        yield Goal(f'demo, {len(frames)} scans, {name} rotation', rotation, degrees, 'deg')
        yield Goal(f'demo, {name} translation', 1e3 * translation, millimetres, 'mm')
    open_ = sum(not frame.refinement.result.converged for frame in frames)
    yield Goal('demo, scans that did not converge', open_, 0)


def _real(kind, pairs, limits, config, seeds):
    off_deg, off_m, within_deg, within_m = limits
    off, open_ = [], 0
    for name, arguments in pairs:
        case = real_case(name, *arguments)
        of_case = replace(config, voxel_size=case.voxel_size)
        for seed in range(seeds):
            rng = np.random.default_rng(seed)
            start = displaced(case.truth, case.centroid, off_deg, off_m, rng)
            result = register(case.target, case.source, start, of_case)
            open_ += not result.converged
            off.append(errors(case, result.T_target_source))
    rotation, translation = np.max(off, axis=0)
    what = f'{kind}, {len(pairs)} pairs x {seeds} starts'
    yield Goal(f'{what}, worst rotation', rotation, within_deg, 'deg')
    yield Goal(f'{kind}, worst translation', 1e3 * translation, 1e3 * within_m, 'mm')
    yield Goal(f'{kind}, starts that did not converge', open_, 0)


def _live(config, rounds):
    """Time a refinement of two new clouds, messages in, as the node does it."""
    case = dense_street('live', 15_000, None)
    rng = np.random.default_rng(0)
    chosen = [
        cloud[rng.permutation(len(cloud))[:LIVE_POINTS]] for cloud in (case.target, case.source)
    ]
    start = displaced(case.truth, case.centroid, 1.5, 0.3, rng)
    guess = Guess(start, 'map', 'lidar')

    def refine(_):
        target, source = (
            cloud_message(c, 1, f) for c, f in zip(chosen, ('map', 'lidar'), strict=True)
        )
        Refiner(config).refine(Pair(target, source, guess))

    milliseconds = interleaved_ms({'refine': refine}, rounds)['refine']
    what = f'one refinement of 2 x {LIVE_POINTS} points, median'
    return Goal(what, float(np.median(milliseconds)), 200.0, 'ms')
