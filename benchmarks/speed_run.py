"""All measurements of time and memory, one after the other."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from benchmarks.case import LEVELS, starts
from benchmarks.footprint import first_result, memory
from benchmarks.q_tot_time import q_tot_ms
from benchmarks.speed import as_given_ms, measure_row
from benchmarks.speed_cases import DENSITIES, dense_street, speed_rows
from benchmarks.time_to_accuracy import race
from idem_ros.core import warm_up

SCENES = ('street', 'room', 'forest')
WARM_STARTS = 5


@dataclass(frozen=True)
class Effort:
    """How much is measured."""

    rounds: int = 9  # of every method on every row, at least
    seconds: float = 3.0  # of a row and number of threads, at least
    seeds: int = 16  # scenes of a kind, in the race for accuracy
    scenes: tuple = SCENES
    sizes: tuple = tuple(DENSITIES)
    memory_points: int = 500_000


QUICK = Effort(3, 0.0, 1, ('street',), (5_000, 50_000), 50_000)


@dataclass
class SpeedResult:
    """What `measure` found; parts are empty until they are measured."""

    rows: list = field(default_factory=list)  # of SpeedRow
    as_given: dict = field(default_factory=dict)  # points -> median_and_p95
    races: list = field(default_factory=list)  # of Race
    q_tot: dict = field(default_factory=dict)
    memory: dict = field(default_factory=dict)
    memory_points: int = 0
    first_result: dict = field(default_factory=dict)  # 'warm', 'cold' -> seconds


def measure(config, quick=False, progress: Callable = lambda steps: steps):
    """Return the `SpeedResult` of everything; `progress` wraps the iteration over the steps."""
    effort, result = QUICK if quick else Effort(), SpeedResult()
    warm_up()
    for step in progress([*_steps(config, effort, quick)]):
        step(result)
    return result


def _steps(config, effort, quick):
    """Yield functions that add to a `SpeedResult` each."""
    for name, build in speed_rows(quick).items():
        yield partial(_row, name, build, config, effort)
    for points in effort.sizes:
        yield partial(_as_given, points, config, effort)
    for kind in effort.scenes:
        yield partial(_race, kind, config, effort)
    yield partial(_q_tot, effort)
    yield partial(_memory, effort.memory_points)
    yield _first_results


def _row(name, build, config, effort, result):
    result.rows.append(measure_row(name, build(), config, effort.rounds, effort.seconds))


def _as_given(points, config, effort, result):
    case = replace(dense_street(f'street {points}', points, 0.5), voxel_size=None)
    result.as_given[points] = as_given_ms(case, config, min(effort.rounds, 5))


def _race(kind, config, effort, result):
    result.races.append(race(kind, config, effort.seeds))


def _q_tot(effort, result):
    result.q_tot.update(q_tot_ms(max(effort.rounds, 7)))


def _memory(points, result):
    result.memory_points = 2 * points
    result.memory.update(memory(dense_street('memory', points, 0.5)))


def _first_results(result):
    case = dense_street('first result', 15_000, 0.5)
    (T_guess,) = starts(case, LEVELS[0], 1)
    warm = [first_result(case, T_guess, cold=False)[0] for _ in range(1 + WARM_STARTS)]
    cold, said = first_result(case, T_guess, cold=True)
    result.first_result.update(warm=float(np.median(warm[1:])), cold=cold, cold_says=said)
