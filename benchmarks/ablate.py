"""What each tuned number is worth: all is run again with its neutral value, on unseen cases.

What no registration asked for is not run again: it cannot change the result.
"""

from collections import defaultdict
from dataclasses import dataclass, fields, replace
from itertools import starmap
from time import thread_time
from typing import NamedTuple
from zlib import crc32

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.ablate_cases import STARTS
from benchmarks.case import Unseen, displaced, errors
from idem_ros.core import RegistrationConfig, register, warm_up
from idem_ros.core.trust.verdict import Verdict
from idem_ros.core.trust_tuning import TrustTuning
from idem_ros.core.tuning import SolverTuning
from idem_ros.evaluation.worker_processes import worker_pool

AS_TUNED, AT_AUTO = '', 'auto'  # all as tuned, with the case's voxel size and with that found


class Number(NamedTuple):
    """A tuned number, and what it is set to where it is left out."""

    name: str
    value: float
    reason: str
    neutral: float
    of: str  # the argument of `register` that holds it
    acts_on_auto: bool = False  # and not where the voxel size is given


class Run(NamedTuple):
    """One registration."""

    rotation: float  # [deg]
    translation: float  # of the source's centroid, in spacings
    right: bool
    ms: float  # of the CPU, raw points to verdict
    aligned: bool
    # squared error over its covariance and the six dimensions; None: the truth is not exact
    surprise: float | None


@dataclass(frozen=True)
class Compared:
    """The runs of a group at a level with a number, and without it, in the same order."""

    number: str
    group: str
    level: str
    tuned: tuple
    neutral: tuple


def numbers(names=()):
    """Return every tuned `Number`, or those of these names."""
    found = [
        Number(
            *(each.name, each.default, each.metadata['reason'], each.metadata['neutral'], of),
            each.metadata['acts_on_auto'],
        )
        for of, tuning in (('tuning', SolverTuning), ('trust', TrustTuning))
        for each in fields(tuning)
    ]
    return [number for number in found if not names or number.name in names]


def ablate(cases, chosen, jobs=1, progress=lambda steps, total: steps):
    """Return the `Compared` of each number, group of cases and level of `STARTS`.

    Args:
        cases: `Unseen`s.
        chosen: `Number`s.
        jobs: processes that share the cases.
        progress: wraps the iteration over the cases.
    """
    warm_up()  # once, so that the processes find the kernels in the cache
    tasks = [(case, tuple(chosen)) for case in cases]
    runs = defaultdict(list)
    if jobs == 1:
        outcomes = starmap(_measured, tasks)
        _collect(runs, progress(outcomes, len(tasks)))
    else:
        with worker_pool(jobs) as pool:
            _collect(runs, progress(pool.map(_measured, *zip(*tasks, strict=True)), len(tasks)))
    tuned = {each.name: AT_AUTO if each.acts_on_auto else AS_TUNED for each in chosen}
    return [
        Compared(number, group, level, tuple(runs[tuned[number], group, level]), tuple(of))
        for (number, group, level), of in runs.items()
        if number in tuned
    ]


def compared_record(compared):
    """Return all runs as what JSON holds."""
    return {
        'compared': [
            {
                **{name: getattr(each, name) for name in ('number', 'group', 'level')},
                'tuned': [run._asdict() for run in each.tuned],
                'neutral': [run._asdict() for run in each.neutral],
            }
            for each in compared
        ]
    }


def _collect(runs, outcomes):
    for outcome in outcomes:
        for key, run in outcome:
            runs[key].append(run)


def _measured(unseen: Unseen, chosen):
    """Return [((number, group, level), `Run`), ...] of a case, as tuned and without each."""
    case = unseen.build()
    given, auto = RegistrationConfig(voxel_size=case.voxel_size), RegistrationConfig()
    of_auto = [number for number in chosen if number.acts_on_auto]
    of_given = [number for number in chosen if not number.acts_on_auto]
    found = []
    register(case.target, case.source, case.truth, given)  # so that none bears the first's costs
    for level, (degrees, multiple) in STARTS.items():
        rng = np.random.default_rng(crc32(f'{case.name} {level}'.encode()))
        guess = displaced(case.truth, case.centroid, degrees, multiple * case.spacing, rng)
        runs = _runs(unseen, case, guess, given, of_given, AS_TUNED)
        if of_auto:
            runs |= _runs(unseen, case, guess, auto, of_auto, AT_AUTO)
        found += [((name, unseen.group, level), run) for name, run in runs.items()]
    return found


def _runs(unseen, case, guess, config, chosen, tuned):
    """Return {name: `Run`}: as tuned, by that name, and without each number.

    Without one that was not asked for as tuned it is the same run.
    """
    whole, asked = _watched()
    runs = {tuned: _run(unseen, case, guess, config, tuning=whole)}
    for number in chosen:
        if number.of == 'tuning' and number.name not in asked:
            runs[number.name] = runs[tuned]
            continue
        record = SolverTuning() if number.of == 'tuning' else TrustTuning()
        without = {number.of: replace(record, **{number.name: number.neutral})}
        runs[number.name] = _run(unseen, case, guess, config, **without)
    return runs


def _watched():
    """Return a `SolverTuning`, and the set of names of its numbers that are asked for."""
    asked = set()

    class Watched(SolverTuning):
        """Notes what is asked for."""

        def __getattribute__(self, name):
            asked.add(name)
            return super().__getattribute__(name)

    return Watched(), asked


def _run(unseen, case, guess, config, **tuning):
    begin = thread_time()
    result = register(case.target, case.source, guess, config, **tuning)
    ms = 1e3 * (thread_time() - begin)
    off = errors(case, result.T_target_source)
    return Run(
        off[0],
        off[1] / case.spacing,
        right=unseen.is_right(case, *off),
        ms=ms,
        aligned=result.assessment.verdict is Verdict.ALIGNED,
        surprise=_surprise(result, case.truth) if unseen.is_exact else None,
    )


def _surprise(result, truth):
    """Return the squared error over its covariance and its six dimensions."""
    T = result.T_target_source
    turn = Rotation.from_matrix(truth[:3, :3] @ T[:3, :3].T).as_rotvec()
    off = np.concatenate([truth[:3, 3] - T[:3, 3], turn])
    return float(off @ np.linalg.solve(result.assessment.covariance, off)) / len(off)
