"""Run every method from every start of every row, each peer at its best setting."""

from collections import defaultdict
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from benchmarks.case import LEVELS, displacement, errors, starts, succeeded
from benchmarks.methods import IDEM, PEERS, Setting, idem_solver, peer_solvers
from idem_ros.core import warm_up
from idem_ros.evaluation.worker_processes import worker_pool

TRIAL = 4  # starts of one case after which only the best of a peer's settings goes on


class Run(NamedTuple):
    """One method from one start, and how far from the truth it ended."""

    level: int  # index in LEVELS
    setting: Setting
    rotation_deg: float
    translation_m: float
    displacement: float  # both in one, in spacings
    success: bool


class Task(NamedTuple):
    """What one call of a worker does: one case of one row."""

    row: int
    build: object
    starts: int
    settings: tuple
    config: object


class Outcome(NamedTuple):
    """What came of a task."""

    row: int
    spacing: float
    truth_rotation_deg: float
    truth_translation_m: float
    runs: list


@dataclass(frozen=True)
class Figures:
    """A method at one level of one row: errors over all runs, and over those that succeeded."""

    method: str
    setting: Setting
    runs: int
    success: float
    rotation_deg: dict
    """'median', 'p90' over all runs, 'median_successful', 'p90_successful'; None: no such run."""
    translation_m: dict
    each_rotation_deg: tuple
    """Of every run, in the order of cases and starts, as are those of the other methods."""
    each_translation_m: tuple  # None: without bound


@dataclass(frozen=True)
class RowResult:
    """The figures of a row: one tuple per level, IDEM first, then the peers that were run."""

    name: str
    kind: str
    spacing: float
    truth_rotation_deg: float
    truth_translation_m: float
    levels: tuple


def measure_rows(rows, settings, config, jobs=1, progress=lambda outcomes, total: outcomes):
    """Return the `RowResult` of each row.

    Args:
        rows: `Row`s.
        settings: the peers' `Setting`s that are tried; none: IDEM runs alone.
        config: `RegistrationConfig` of IDEM; its voxel size is the case's.
        jobs: how many processes share the cases.
        progress: wraps the iteration over `total` outcomes to show how far it is.
    """
    tasks = [
        Task(number, build, row.starts, tuple(settings), config)
        for number, row in enumerate(rows)
        for build in row.builders
    ]
    warm_up()  # once, so that the workers find the kernels in the cache
    outcomes = defaultdict(list)
    if jobs == 1:
        for outcome in progress(map(measure_case, tasks), len(tasks)):
            outcomes[outcome.row].append(outcome)
    else:
        with worker_pool(jobs) as pool:
            for outcome in progress(pool.map(measure_case, tasks), len(tasks)):
                outcomes[outcome.row].append(outcome)
    return [_row_result(row, outcomes[number]) for number, row in enumerate(rows)]


def measure_case(task):
    """Return the `Outcome` of a `Task`: all settings from the starts of one case."""
    case = task.build()
    solvers = {Setting(IDEM): idem_solver(case, task.config)}
    if task.settings:
        solvers.update(peer_solvers(case, task.settings))
    runs = []
    for number, level in enumerate(LEVELS):
        guesses = starts(case, level, task.starts)
        for method in (IDEM, *PEERS):
            chosen = {s: solve for s, solve in solvers.items() if s.method == method}
            if chosen:
                runs += race(case, number, chosen, guesses)
    return Outcome(task.row, case.spacing, case.truth_rotation_deg, case.truth_translation_m, runs)


def race(case, level, solvers, guesses):
    """Run all settings of a method from the first starts, and from the others the best one.

    Args:
        case: `Case`.
        level: index of the guesses' level; it is only written into the runs.
        solvers: {`Setting` of the method: solve(T_guess) -> (T_target_source, converged)}.
        guesses: list of (4, 4).

    Returns:
        list of `Run`: of the best setting, or of all where the first starts are all.
    """
    runs = {
        setting: [_run(case, level, setting, solve, T) for T in guesses[:TRIAL]]
        for setting, solve in solvers.items()
    }
    if len(guesses) > TRIAL:
        best = min(runs, key=lambda setting: _rank(runs[setting]))
        others = [_run(case, level, best, solvers[best], T) for T in guesses[TRIAL:]]
        return runs[best] + others
    return [run for tried in runs.values() for run in tried]


def _run(case, level, setting, solve, T_guess):
    T, _ = solve(T_guess)
    off = errors(case, T)
    return Run(level, setting, *off, displacement(case, *off), succeeded(case, *off))


def _row_result(row, outcomes):
    runs = [run for outcome in outcomes for run in outcome.runs]
    methods = [m for m in (IDEM, *PEERS) if any(run.setting.method == m for run in runs)]
    return RowResult(
        name=row.name,
        kind=row.kind,
        spacing=float(np.mean([outcome.spacing for outcome in outcomes])),
        truth_rotation_deg=outcomes[0].truth_rotation_deg,
        truth_translation_m=outcomes[0].truth_translation_m,
        levels=tuple(
            tuple(at_best(runs, level, method) for method in methods)
            for level in range(len(LEVELS))
        ),
    )


def at_best(runs, level, method):
    """Return a method's `Figures` at the setting that served it best in these very `Run`s."""
    by_setting = defaultdict(list)
    for run in runs:
        if run.level == level and run.setting.method == method:
            by_setting[run.setting].append(run)
    setting, best = min(by_setting.items(), key=lambda item: _rank(item[1]))
    return Figures(
        method=method,
        setting=setting,
        runs=len(best),
        success=float(np.mean([run.success for run in best])),
        rotation_deg=_percentiles(best, 'rotation_deg'),
        translation_m=_percentiles(best, 'translation_m'),
        each_rotation_deg=tuple(run.rotation_deg for run in best),
        each_translation_m=tuple(_bounded(run.translation_m) for run in best),
    )


def _rank(runs):
    """Smaller is better: failures first, then the median error."""
    failures = sum(not run.success for run in runs)
    return failures, np.median([run.displacement for run in runs])


def _bounded(error):
    return float(error) if np.isfinite(error) else None


def _percentiles(runs, name):
    result = {}
    for suffix, chosen in (('', runs), ('_successful', [run for run in runs if run.success])):
        values = [getattr(run, name) for run in chosen]
        for key, percent in (('median', 50), ('p90', 90)):
            known = bool(values) and np.isfinite(np.percentile(values, percent))
            result[key + suffix] = float(np.percentile(values, percent)) if known else None
    return result
