"""Run every trial of trust and hold what it shows against the figures to reach."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from benchmarks.bare_scenes import BARE_SCENES
from benchmarks.case import LEVELS, starts
from benchmarks.goal import Goal
from benchmarks.timing import interleaved_ms
from benchmarks.trust.convoys import convoy_goals, convoy_tasks
from benchmarks.trust.fit import (
    best_threshold,
    calibration_error,
    is_seen,
    left_out,
    roc_area,
)
from benchmarks.trust.freedom import freedom
from benchmarks.trust.places import PLACES
from benchmarks.trust.places_spread import place_goals
from benchmarks.trust.poses import PEER_SCORES, judged_poses
from benchmarks.trust.scenes import real, simulated
from benchmarks.trust.sensors import place_case
from benchmarks.trust.shipped import FIRST_SEED, cases, other_place, said_of, shipped_goals
from benchmarks.trust.spread import spread, worst_coverage
from benchmarks.trust.ways import ways
from idem_ros.core import Cloud, register, warm_up
from idem_ros.core.coarse_to_fine import descend
from idem_ros.core.metric.balls import between_origins
from idem_ros.core.solve.pair import prepare, with_stages
from idem_ros.core.trust.basin import gauge, way_between
from idem_ros.core.trust_tuning import TRUST
from idem_ros.core.tuning import SOLVER
from idem_ros.core.workers import ALONE
from idem_ros.evaluation.worker_processes import worker_pool

# cases of a kind; of 48, the worst of six axes is off by 11 points of coverage by chance alone
SHIPPED, PLACED, CONVOYS = 12, 192, 12
JUDGED, SPREAD, WAYS, BARE = 24, 200, 20, 60  # likewise
PLACE_SEED = 60_000
ROUNDS = 25
WRONG, CALIBRATION, GAP, NEES = 2.0, 0.03, 5.0, 1.25  # [%], -, [points], times 6 or a sixth of it
UNFOUND, DRIFT, UNFORETOLD = 1.0, 10.0, 0.05  # [%], [mm], 1 - area under the ROC curve
COST, GAUGE_COST = 25.0, 15.0  # [%] of the refinement


def measure(config, trials=None, parts=None, jobs=1, progress=lambda steps, total=None: steps):
    """Return the `Goal`s of trust.

    Args:
        config: `RegistrationConfig` of the timings; the trials take the defaults.
        trials: cases of a kind; None: as many as each part takes.
        parts: of `PARTS` and 'cost'; None: all.
        jobs: processes that share them.
        progress: wraps the iteration over `total` trials.
    """
    warm_up()
    parts = (*PARTS, COST_PART) if parts is None else parts
    tasks = {name: PARTS[name].tasks(trials) for name in parts if name in PARTS}
    of_all = [task for some in tasks.values() for task in some]
    with worker_pool(jobs) as pool:
        outcomes = iter(list(progress(pool.map(_call, of_all), len(of_all))))
    goals = []
    for name, some in tasks.items():
        goals += PARTS[name].goals([next(outcomes) for _ in some])
    if COST_PART in parts:
        goals += _cost_goals(config, simulated(1)['street'][0]())
    return goals


class Part(NamedTuple):
    """Trials that can be run at once, and what is held against the figures to reach."""

    tasks: Callable  # of the number of cases of a kind, or None: its own; returns functions
    goals: Callable  # of what each returned; returns `Goal`s


def _shipped_tasks(trials):
    trials = trials or SHIPPED
    found = [partial(said_of, kind, each) for kind, each in cases(trials)]
    seeds = range(FIRST_SEED, FIRST_SEED + trials)
    return found + [partial(other_place, kind, s) for kind in ('street', *PLACES) for s in seeds]


def _shipped_goals(outcomes):
    return list(shipped_goals([each for some in outcomes for each in some]))


def _place_tasks(trials):
    seeds = range(PLACE_SEED, PLACE_SEED + (trials or PLACED))
    return [
        partial(spread, kind, partial(place_case, kind, seed))
        for kind in ('street', *PLACES)
        for seed in seeds
    ]


def _place_goals(outcomes):
    return list(place_goals([each for each in outcomes if each is not None]))


def _convoy_tasks(trials):
    return convoy_tasks(trials or CONVOYS)


def _convoy_goals(outcomes):
    return list(convoy_goals([each for some in outcomes for each in some]))


def _verdict_tasks(trials):
    of_kinds = _some(simulated(trials or JUDGED), trials or JUDGED)
    of_kinds += _some(real(), trials)
    return [partial(judged_poses, kind, build) for kind, build in of_kinds]


def _verdict_goals(outcomes):
    return list(verdict_goals([each for some in outcomes for each in some]))


def _spread_tasks(trials):
    count = trials or SPREAD
    return [partial(spread, kind, build) for kind, build in _some(simulated(count), count)]


def _spread_goals(outcomes):
    return list(_covariance_goals([x for x in outcomes if x is not None], len(outcomes)))


def _basin_tasks(trials):
    count = trials or WAYS
    return [partial(ways, kind, build) for kind, build in _some(simulated(count), count)]


def _freedom_tasks(trials):
    return [partial(freedom, name, s) for name in BARE_SCENES for s in range(trials or BARE)]


PARTS = {
    'shipped': Part(_shipped_tasks, _shipped_goals),
    'covariance': Part(_place_tasks, _place_goals),
    'convoys': Part(_convoy_tasks, _convoy_goals),
    'models': Part(_verdict_tasks, _verdict_goals),
    'spread': Part(_spread_tasks, _spread_goals),
    'free': Part(_freedom_tasks, lambda outcomes: list(_freedom_goals(outcomes))),
    'basin': Part(_basin_tasks, lambda found: list(_basin_goals([w for ws in found for w in ws]))),
}
COST_PART = 'cost'


def _some(cases, count):
    return [(kind, build) for kind, builders in cases.items() for build in builders[:count]]


def _call(task):
    return task()


def verdict_goals(poses):
    """Return the `Goal`s of the verdict, each kind judged by a model that never saw it."""
    unclear = sum(each.right is None for each in poses)
    poses = [each for each in poses if each.right is not None]
    kinds = [each.kind for each in poses]
    right = np.array([each.right for each in poses])
    seen = np.array([is_seen(each) for each in poses])
    by_kind = {kind: iter(p) for kind, p in left_out(poses).items()}
    p = np.array([next(by_kind[kind]) for kind in kinds])
    wrong = 100 * float(np.mean(((p > 0.5) & seen) != right))
    what = f'cross-validated verdict: wrong, of {len(poses)} poses'
    yield Goal(f'{what} ({unclear} more neither right nor wrong)', wrong, WRONG, '%')
    for kind in dict.fromkeys(kinds):
        of_kind = np.array([each == kind for each in kinds])
        share = 100 * float(np.mean(((p > 0.5) & seen)[of_kind] != right[of_kind]))
        yield Goal(
            f'cross-validated verdict: wrong, of {of_kind.sum()} in {kind}', share, WRONG, '%'
        )
    said = f'cross-validated verdict: expected calibration error, of {seen.sum()}'
    yield Goal(said, calibration_error(p[seen], right[seen]), CALIBRATION)
    for number, name in enumerate(PEER_SCORES):
        score = np.array([each.peers[number] for each in poses])
        of_peer = _wrong_by_threshold(score, right, kinds)
        yield Goal(
            f'cross-validated verdict: wrong, over {name} ({of_peer:.1f} % wrong)',
            wrong / of_peer,
            1.0,
        )


def _wrong_by_threshold(score, right, kinds):
    """Return the share [%] that a score gets wrong, its threshold learnt on the other kinds."""
    wrong = 0
    for kind in dict.fromkeys(kinds):
        here = np.array([each == kind for each in kinds])
        threshold = best_threshold(score[~here], right[~here])
        wrong += np.sum((score[here] > threshold) != right[here])
    return 100 * float(wrong) / len(right)


def _covariance_goals(spreads, tried):
    kinds = dict.fromkeys(each.kind for each in spreads)
    what = f'of {len(spreads)} registrations in {len(kinds)} kinds of scene'
    if tried > len(spreads):
        what += f' ({tried - len(spreads)} more failed)'
    gap = worst_coverage(spreads)
    yield Goal(f'covariance: worst gap to 68 / 95 / 99.7 %, {what}', gap, GAP, 'points')
    ratio = float(np.mean([each.nees for each in spreads])) / 6
    yield Goal('covariance: mean NEES over 6', ratio, NEES)
    yield Goal('covariance: 6 over mean NEES', 1 / ratio, NEES)


def _freedom_goals(trials):
    unfound = 100 * float(np.mean([not each.found for each in trials]))
    what = f'free motions: subspace not found, of {len(trials)} trials'
    yield Goal(what, unfound, UNFOUND, '%')
    drift = [1e3 * each.drift for each in trials if BARE_SCENES[each.scene][1]]
    yield Goal('free motions: p90 of the drift along them', np.percentile(drift, 90), DRIFT, 'mm')


def _basin_goals(solves):
    success = [each.success for each in solves]
    area = roc_area([each.confidence for each in solves], success)
    what = f'basin: 1 - area under the ROC curve, {sum(success)} of {len(solves)} solves succeed'
    yield Goal(what, 1 - area, UNFORETOLD)


def _cost_goals(config, case):
    """Time what a node does: the target kept, every source new."""
    start = starts(case, LEVELS[0], 1)[0]
    target, source = Cloud(case.target), Cloud(case.source)
    configs = {
        name: replace(config, voxel_size=case.voxel_size, assessment=name)
        for name in ('verdict', 'none')
    }
    T_guess = between_origins(target, source, start)
    pair = prepare(target, source, configs['none'], SOLVER, TRUST, ALONE)
    descent = descend(with_stages(pair), T_guess)
    calls = {
        name: lambda _, c=c: register(target, Cloud(case.source), start, c)
        for name, c in configs.items()
    }
    T = descent.solution.transform
    way = way_between(descent.first, T, T_guess)
    calls['gauge'] = lambda _: gauge(descent.first, T, T_guess, way)
    times = interleaved_ms(calls, ROUNDS)
    told, bare, gauged = (float(np.median(times[name])) for name in calls)
    what = f'verdict and covariance, of a refinement of {bare:.1f} ms'
    yield Goal(what, 100 * (told - gauged - bare) / bare, COST, '%')
    yield Goal('basin gauge, likewise', 100 * gauged / bare, GAUGE_COST, '%')
