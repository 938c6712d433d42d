"""Errors of sweeps, their motion undone in several ways, over those of sensors standing still."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.case import succeeded
from benchmarks.goal import Goal
from benchmarks.sweeps.cases import ODOMETRY_ERROR, SCENES, sweep
from benchmarks.sweeps.information import least_ratios
from idem_ros.core import Cloud, register
from idem_ros.replay.frames import rotation_error_deg, translation_error_m

FIRST_SEED = 1000  # nothing was chosen on sweeps from there on
STILL, EXACT, SOLVED = 'standing still', 'the exact twist', 'solved from no motion'
TOLD, SOLVED_ON = 'a twist 5 % off', 'solved from a twist 5 % off'
RAW = 'nothing undone'
MOST = {EXACT: 1.1, SOLVED_ON: 1.3, SOLVED: 1.5}
"""The errors' median and 90th percentile, at most, over those of sensors standing still."""
LEAST_SUCCESS = 0.99
NEES = 0.7, 1.5  # over 6
DRAWS, BOUNDS = 1000, (2.5, 97.5)  # of sweeps with replacement; percentiles of what they give


class Outcome(NamedTuple):
    """One registration."""

    kind: str
    way: str
    rotation_deg: float
    translation_m: float
    is_right: bool
    nees: float  # over 6
    rings: int
    least: tuple[float, float] | None = None
    """Errors over those of the sensor standing still, by information, where it is solved."""


def ways(a_sweep):
    """Return {way: (source, motion, twist)} of a `cases.Sweep`."""
    in_motion = Cloud(a_sweep.points, a_sweep.times)
    return {
        STILL: (Cloud(a_sweep.still.source), 'none', None),
        RAW: (in_motion, 'none', None),
        EXACT: (in_motion, 'guess', a_sweep.twist),
        TOLD: (in_motion, 'guess', a_sweep.odometry),
        SOLVED: (in_motion, 'solve', None),
        SOLVED_ON: (in_motion, 'solve', a_sweep.odometry),
    }


def measure(config, trials, progress):
    """Return the `Outcome`s of so many sweeps, of every scene in turn, in all ways.

    Args:
        config: `RegistrationConfig`, but for its voxels and its motion.
        trials: how many sweeps.
        progress: wraps the iteration over them.
    """
    kinds = list(SCENES)
    found = []
    for k in progress(range(trials)):
        a_sweep = sweep(kinds[k % len(kinds)], FIRST_SEED + k // len(kinds))
        target, standing = Cloud(a_sweep.still.target), None
        for way, (source, motion, twist) in ways(a_sweep).items():
            given = config('auto', motion)
            if way == SOLVED_ON:
                given = replace(given, twist_sigma=sigma_of(twist))
            result = register(target, source, a_sweep.guess, given, twist=twist)
            standing = result.assessment.covariance if way == STILL else standing
            least = None
            if motion == 'solve':
                of_size = replace(given, voxel_size=result.voxel_size)
                least = least_ratios(a_sweep, of_size, standing, given.twist_sigma)
            found.append(_outcome(a_sweep, way, result)._replace(least=least))
    return found


def sigma_of(odometry):
    """Return the standard deviations that an odometry would state: its share of either speed."""
    linear, angular = np.linalg.norm(np.reshape(odometry, (2, 3)), axis=1)
    return ODOMETRY_ERROR * linear, ODOMETRY_ERROR * np.degrees(angular)


def _outcome(a_sweep, way, result):
    truth, T = a_sweep.still.truth, result.T_target_source
    errors = rotation_error_deg(T, truth), translation_error_m(T, truth)
    turn = T[:3, :3] @ truth[:3, :3].T
    small = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    off = np.concatenate([T[:3, 3] - truth[:3, 3], small / 2])
    nees = float(off @ np.linalg.solve(result.assessment.covariance, off)) / 6
    right = succeeded(a_sweep.still, *errors)
    return Outcome(a_sweep.kind, way, *errors, bool(right), nees, a_sweep.rings)


def of_way(outcomes, way):
    """Return the `Outcome`s of a way."""
    return [each for each in outcomes if each.way == way]


def figures(outcomes):
    """Return median and 90th percentile of both errors [deg], [m], the share right, the NEES.

    The NEES is the mean over those that are right, and then the median.
    """
    rotation, translation = np.array([[o.rotation_deg, o.translation_m] for o in outcomes]).T
    right = [o for o in outcomes if o.is_right]
    return (
        *np.percentile(rotation, [50, 90]),
        *np.percentile(translation, [50, 90]),
        len(right) / len(outcomes),
        *(float(of([o.nees for o in right])) if right else np.nan for of in (np.mean, np.median)),
    )


def ratios(outcomes, way):
    """Return [(ratio, low, high)] of a way's errors over those of sensors standing still.

    Of median and 90th percentile of the rotation, and of the translation; with their bounds by
    draws of sweeps.
    """
    return _ratios(*(_errors(outcomes, each) for each in (way, STILL)))


def least(outcomes, way):
    """Return the same of a way by information: as if each standing error grew by its share."""
    still = _errors(outcomes, STILL)
    return _ratios(still * np.array([o.least for o in of_way(outcomes, way)]), still)


def _errors(outcomes, way):
    return np.array([(o.rotation_deg, o.translation_m) for o in of_way(outcomes, way)])


def _ratios(*errors):
    rng, count = np.random.default_rng(0), len(errors[0])
    draws = [np.arange(count), *rng.integers(0, count, (DRAWS, count))]
    ours, theirs = (
        np.array([np.percentile(each[some], [50, 90], axis=0).T.ravel() for some in draws])
        for each in errors
    )
    found = ours / theirs
    return list(zip(found[0], *np.percentile(found[1:], BOUNDS, axis=0), strict=True))


def with_standing_right(outcomes):
    """Return the `Outcome`s of those sweeps of which a sensor that stands still is right."""
    ways_each = len({each.way for each in outcomes})
    kept = []
    for k in range(0, len(outcomes), ways_each):
        of_sweep = outcomes[k : k + ways_each]
        if of_way(of_sweep, STILL)[0].is_right:
            kept += of_sweep
    return kept


def goals(outcomes):
    """Return the `Goal`s of all scenes together, where a sensor that stands still is right."""
    outcomes = with_standing_right(outcomes)
    names = 'rotation, median', 'rotation, p90', 'translation, median', 'translation, p90'
    for way, most in MOST.items():
        found = figures(of_way(outcomes, way))
        for name, (ratio, _, _) in zip(names, ratios(outcomes, way), strict=True):
            yield Goal(f'{way}: {name}, over {STILL}', ratio, most)
        yield Goal(f'{way}: not right', 100 * (1 - found[4]), 100 * (1 - LEAST_SUCCESS), '%')
        yield Goal(f'{way}: NEES over 6', found[5], NEES[1])
        yield Goal(f'{way}: 1 / (NEES over 6)', 1 / found[5], 1 / NEES[0])
