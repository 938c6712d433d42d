"""The pairs of table 2 in six degrees of freedom: IDEM and peers from starts around the truth."""

import json
from concurrent.futures import as_completed
from dataclasses import asdict
from typing import NamedTuple

import numpy as np

from benchmarks.accuracy import Figures, at_best, race
from benchmarks.case import Case as RegistrationCase
from benchmarks.methods import IDEM, PEERS, Setting, idem_solver, peer_solvers, settings
from benchmarks.six_dof.independent import independent_case
from idem_ros.core import RegistrationConfig, warm_up
from idem_ros.core.metric.landscape import centroid, displaced
from idem_ros.core.metric.region_of_interest import FARTHEST, STEPS_PER_RADIUS, region_along_axes
from idem_ros.evaluation.worker_processes import worker_pool
from idem_ros.experiments.conditions import Case, make_case
from idem_ros.experiments.experiment import settings_of
from idem_ros.experiments.maps import count_in_common, landscape_of
from idem_ros.experiments.models import Model
from idem_ros.files.atomic_file import replacing

NEAR = 'IDEM 4r'  # for guesses about one radius off, as these are: no stage of eight radii
CONFIGS = {IDEM: RegistrationConfig(), NEAR: RegistrationConfig(radius_schedule=(4.0, 2.0, 1.0))}
METHODS = (*CONFIGS, *PEERS[:3])
MAKERS = {'shared': make_case, 'independent': independent_case}
PARTS = 'six_dof_cases'  # folder of what an interrupted run need not do again


class Task(NamedTuple):
    """What one call of a worker does: one pair."""

    kind: str  # of MAKERS
    name: str  # of the case
    model: Model
    seed: int
    starts: int
    peers: tuple  # `Setting`s; none: IDEM runs alone


class Outcome(NamedTuple):
    """A pair and what each method did from the same starts."""

    name: str
    unit: str
    points: tuple  # of the target, of the source
    in_common: int  # points of the source that are points of the target
    r_4th: float  # of the pair [unit]
    reach: list  # (6, 2) of the starts along and around x, y, z [unit, rad]
    open_axes: int  # ends of these that no maximum closes
    figures: list  # of `Figures`, in the order of `methods_of`


def measured(context, kind, names, starts, peers):
    """Return the `Outcome` of each case; those that an earlier run left are not done again.

    Args:
        context: `Context`; its threads are processes here.
        kind: 'shared' for the paper's pairs, 'independent' for two samplings.
        names: of `case_names`.
        starts: how many for each case.
        peers: whether small_gicp's methods run, too.
    """
    tried = tuple(settings(resolutions=())) if peers else ()
    common = {**settings_of(context), 'kind': kind, 'starts': starts, 'peers': peers}
    folder = context.out / PARTS
    folder.mkdir(exist_ok=True)
    paths = {name: folder / f'{kind}_{name}.json' for name in names}
    found = {name: _read(paths[name], common) for name in names}
    tasks = [
        Task(kind, name, context.model, context.seed, starts, tried)
        for name in reversed(names)  # the stairs, which take longest, first
        if found[name] is None
    ]
    steps = _outcomes(tasks, context.threads)
    for outcome in context.progress(steps, total=len(tasks), desc=f'six_dof, {kind}'):
        _write(paths[outcome.name], common, outcome)
        found[outcome.name] = outcome
    return [found[name] for name in names]


def outcome_of(task):
    """Return the `Outcome` of a `Task`."""
    pair = MAKERS[task.kind](task.name, task.model, task.seed)
    landscape = landscape_of(pair)
    region = region_along_axes(landscape)
    reach = reach_of(region)
    rng = np.random.default_rng([task.seed, *f'{task.kind} {task.name}'.encode()])
    guesses = starts_within(reach, centroid(landscape, np.eye(4)), task.starts, rng)
    case = RegistrationCase(task.name, pair.target, pair.source, np.eye(4))
    solvers = {Setting(name): idem_solver(case, config) for name, config in CONFIGS.items()}
    if task.peers:
        solvers.update(peer_solvers(case, task.peers))
    return Outcome(
        name=task.name,
        unit=pair.unit,
        points=(len(pair.target), len(pair.source)),
        in_common=count_in_common(pair),
        r_4th=case.spacing,
        reach=reach.tolist(),
        open_axes=int(np.isnan(region.extent).sum()),
        figures=[_figures(case, method, solvers, guesses) for method in methods_of(task.peers)],
    )


def reach_of(region):
    """Return (6, 2): the ends of an `AxialRegion` along each axis.

    Where no maximum closes an axis on one side, as far as on the other; where none does on
    either, as far as was looked.
    """
    looked = STEPS_PER_RADIUS * FARTHEST * region.step
    reach = np.where(np.isnan(region.extent), -region.extent[:, ::-1], region.extent)
    return np.where(np.isnan(reach), np.outer(looked, (-1.0, 1.0)), reach)


def starts_within(reach, pivot, count, rng):
    """Return (count, 4, 4) guesses: each offset even between its ends (6, 2), about a pivot (3,).

    The truth is the identity. Six offsets at once may leave the region, of which `reach` is the
    extent along the axes alone: these starts are the harder for it.
    """
    offsets = rng.uniform(reach[:, 0], reach[:, 1], (count, len(reach)))
    return displaced(np.eye(4), offsets, pivot)


def methods_of(peers):
    """Return the names of the methods that run, in the order of the tables."""
    return METHODS if peers else tuple(CONFIGS)


def _figures(case, method, solvers, guesses):
    own = {setting: solve for setting, solve in solvers.items() if setting.method == method}
    return at_best(race(case, 0, own, guesses), 0, method)


def _outcomes(tasks, jobs):
    """Yield the `Outcome` of each task, in the order in which they end."""
    if not tasks:
        return
    _warm_up()
    if jobs == 1 or len(tasks) == 1:
        yield from map(outcome_of, tasks)
        return
    with worker_pool(min(jobs, len(tasks))) as pool:
        for future in as_completed([pool.submit(outcome_of, task) for task in tasks]):
            yield future.result()


def _warm_up():
    """Compile once here, so that the workers find all kernels in the cache."""
    warm_up()
    points = np.random.default_rng(0).random((64, 3))
    landscape_of(Case('', '', points, points)).at(np.eye(4)[None])


def _write(path, common, outcome):
    record = outcome._replace(figures=[asdict(each) for each in outcome.figures])
    with replacing(path) as temporary:
        temporary.write_text(json.dumps({'made_with': common, **record._asdict()}) + '\n')


def _read(path, common):
    """Return the `Outcome` that a run of the same settings left; None if there is none."""
    try:
        record = json.loads(path.read_text())
        if record.pop('made_with') != common:
            return None
        figures = [
            Figures(**{**each, 'setting': Setting(*each['setting'])})
            for each in record.pop('figures')
        ]
        return Outcome(**record, figures=figures)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None
