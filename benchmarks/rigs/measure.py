"""What is measured of simulated rigs, and held against the figures to reach."""

from typing import NamedTuple

import numpy as np

from benchmarks.goal import Goal
from benchmarks.rigs.scenes import rig_scene
from idem_ros.calibration.fusion import difference
from idem_ros.calibration.rig_calibration import calibrate
from idem_ros.core import IdemError
from idem_ros.terminal.markdown import number, table

NEAR, FAR = (10.0, 0.3), (45.0, 0.5)  # [deg], [m] that starts are off
INSTANTS = 1, 3
LEVELS = {(NEAR, 1): 0.99, (NEAR, 3): 0.99, (FAR, 1): 0.95}
MEDIAN, TENTH = (5.0, 0.05), (15.0, 0.15)  # [mm], [deg]
RIGHT_M, RIGHT_DEG = 0.05, 0.5


class Error(NamedTuple):
    """How far one sensor of one rig ended from the truth."""

    trial: int
    metres: float
    degrees: float
    nees: float
    usable: bool

    @property
    def right(self):
        """Whether it is in the right valley."""
        return self.metres <= RIGHT_M and self.degrees <= RIGHT_DEG


def measure_rigs(config, trials, progress=iter):
    """Return {(level, instants): [`Error`]} of every sensor of every rig but the reference."""
    found = {key: [] for key in LEVELS}
    for trial in progress(range(trials)):
        for instants in INSTANTS:
            levels = [level for level, count in LEVELS if count == instants]
            scene = rig_scene(trial, instants, levels)
            for level in levels:
                found[level, instants] += _errors(scene, trial, level, config)
    return found


def rig_goals(found):
    """Return the `Goal`s."""
    goals = []
    for (level, instants), errors in found.items():
        name = f'{_off(level)}, {_instants(instants)}'
        misses = 1.0 - float(np.mean([each.right for each in errors]))
        goals.append(Goal(f'{name}: failures', misses, 1.0 - LEVELS[level, instants] + 1e-9))
        if level is FAR:
            continue
        for what, share, most in (('median', 0.5, MEDIAN), ('p90', 0.9, TENTH)):
            metres, degrees = _quantiles(errors, share)
            goals.append(Goal(f'{name}: {what} of the distance', 1e3 * metres, most[0], 'mm'))
            goals.append(Goal(f'{name}: {what} of the angle', degrees, most[1], 'deg'))
    return goals


def rigs_table(found):
    """Return the errors as a Markdown table."""
    rows = [
        [
            f'{_off(level)}, {_instants(instants)}',
            len({each.trial for each in errors}),
            len(errors),
            *(f'{number(1e3 * m)} mm, {number(d)} deg' for m, d in _both(errors)),
            f'{np.mean([each.right for each in errors]):.1%}',
            f'{np.mean([each.usable for each in errors if each.right]):.0%}',
            sum(each.usable for each in errors if not each.right),
            number(np.median([each.nees for each in errors])),
        ]
        for (level, instants), errors in found.items()
    ]
    heads = ('start off, instants', 'rigs', 'sensors', 'median', 'p90', 'right')
    heads += ('right: called aligned', 'wrong: called aligned', 'NEES, median')
    return table(heads, rows, left=1)


def _errors(scene, trial, level, config):
    try:
        sensors = calibrate(scene.instants, scene.starts[level], config).sensors
    except IdemError:
        return [Error(trial, np.inf, 180.0, np.inf, False) for _ in scene.truth[1:]]
    return [
        error_of(each, truth, trial)
        for each, truth in zip(sensors[1:], scene.truth[1:], strict=True)
    ]


def error_of(sensor, truth, trial):
    """Return the `Error` of a `Fused`, whose pose is truly (4, 4) `truth`."""
    off = difference(sensor.pose, truth)
    nees = float(off @ np.linalg.pinv(sensor.covariance) @ off) / 6
    usable = sensor.verdict.verdict.value in ('aligned', 'degenerate')
    distance, degrees = np.linalg.norm(off[:3]), np.degrees(np.linalg.norm(off[3:]))
    return Error(trial, float(distance), float(degrees), nees, usable)


def _both(errors):
    return [_quantiles(errors, share) for share in (0.5, 0.9)]


def _quantiles(errors, share):
    return tuple(
        float(np.quantile([getattr(each, name) for each in errors], share))
        for name in ('metres', 'degrees')
    )


def _off(level):
    return f'{level[0]:g} deg and {level[1]:g} m'


def _instants(count):
    return f'{count} instant{"s" * (count > 1)}'
