"""What is measured of a trajectory made consistent, and held against the figures to reach."""

import os
import resource
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np

from benchmarks import CHECKOUT
from benchmarks.goal import Goal
from benchmarks.smooth.drives import ground, rounds
from idem_ros.core.geometry import se3
from idem_ros.evaluation.worker_processes import in_processes
from idem_ros.files.trajectory_file import read_trajectory
from idem_ros.replay.settings import Settings
from idem_ros.smoothing.config import SmoothingConfig
from idem_ros.smoothing.joining import joined
from idem_ros.smoothing.run import Asked, smooth
from idem_ros.terminal.markdown import number, table

FIRST_SEED = 4000  # of what is reported; numbers were chosen on seed 0
SCANS, MOST_S, RATIO = 200, 30.0, 0.5
JOBS = 2
FEW, MANY, MOST_GROWTH = 200, 2000, 1.15
MEBIBYTE = 1024.0  # of ru_maxrss, which is in KiB on Linux


@dataclass(frozen=True)
class Driven:
    """What became of a drive: mean errors of the odometry and of the result."""

    seed: int
    seconds: float
    of_processor: float
    """The same, of all processes together [s]."""
    before: tuple[float, float]  # [m], [deg]
    after: tuple[float, float]
    loops: int
    record: dict


def measure_drives(config, trials, scans=SCANS, progress=iter):
    """Return a `Driven` for each of so many drives about a block of a town."""
    return [_driven(FIRST_SEED + trial, scans, config) for trial in progress(range(trials))]


def _driven(seed, scans, config):
    with TemporaryDirectory() as folder:
        recorded = rounds(folder, seed, scans)
        out = Path(folder) / 'out'
        begin, used = perf_counter(), _processor()
        record = _smoothed(recorded, out, config)
        taken = perf_counter() - begin, _processor() - used
        poses = read_trajectory(out / 'trajectory.tum').poses
    loops = sum(each['is_loop'] and each['counts'] for each in record['relations'])
    errors = (_errors(each, recorded.truth) for each in (recorded.odometry, poses))
    return Driven(seed, *taken, *errors, loops, record)


def _processor():
    """Return what the processor has worked for this process and those that it has ended [s]."""
    return sum(os.times()[:4])


def _smoothed(recorded, out, config, **smoothing):
    out.mkdir()
    asked = Asked(
        recorded.recording,
        recorded.trajectory,
        Settings(config=config),
        SmoothingConfig(**smoothing),
    )
    return smooth(asked, out, lambda tasks: in_processes(tasks, JOBS, call=joined))


def _errors(poses, truth):
    off = np.linalg.norm(poses[:, :3, 3] - truth[:, :3, 3], axis=1)
    turns = [se3.rotation_angle(se3.inverse(a) @ b) for a, b in zip(poses, truth, strict=True)]
    return float(off.mean()), float(np.degrees(np.mean(turns)))


def drive_goals(driven):
    """Return the `Goal`s of drives: the worst of them counts."""
    return [
        Goal(f'{SCANS} scans with loops: time', max(each.seconds for each in driven), MOST_S, 's'),
        Goal(
            f'{SCANS} scans with loops: time of the processor',
            max(each.of_processor for each in driven),
            JOBS * MOST_S,
            's',
        ),
        *(
            Goal(
                f"{what} error over the odometry's",
                max(each.after[k] / each.before[k] for each in driven),
                RATIO,
            )
            for k, what in enumerate(('translation', 'rotation'))
        ),
    ]


def drives_table(driven):
    """Return drives as a Markdown table."""
    rows = [
        (
            each.seed,
            each.loops,
            *(f'{number(each.before[k])} → {number(each.after[k])}' for k in (0, 1)),
            *(
                f'{number(each.record["map"]["as_given"][name])} → '
                f'{number(each.record["map"]["smoothed"][name])}'
                for name in ('score', 'mean_map_entropy')
            ),
        )
        for each in driven
    ]
    names = 'drive', 'loops', 'error [m]', 'error [deg]', 'score [nat]', 'mean map entropy [nat]'
    return table(names, rows)


def memory_goal(few=FEW, many=MANY):
    """Return the `Goal` of how the peak memory grows with the scans; each in a fresh process."""
    peaks = [_peak(scans) for scans in (few, many)]
    figure = (
        f'peak memory of {many} small scans over that of {few} '
        f'({peaks[1]:.0f} and {peaks[0]:.0f} MiB)'
    )
    return Goal(figure, peaks[1] / peaks[0], MOST_GROWTH)


def _peak(scans):
    """Return the greatest resident set of a process that smooths so many, or a worker [MiB]."""
    said = subprocess.run(
        [sys.executable, '-m', 'benchmarks.smooth.measure', str(scans)],
        cwd=CHECKOUT,
        env={**os.environ, 'OPENBLAS_NUM_THREADS': '1'},
        capture_output=True,
        text=True,
        check=True,
    )
    return float(said.stdout.split()[-1])


def _main(scans):
    from idem_ros.core import RegistrationConfig

    with TemporaryDirectory() as folder:
        recorded = ground(folder, FIRST_SEED, scans)
        config = RegistrationConfig(voxel_size=0.5)
        _smoothed(recorded, Path(folder) / 'out', config, keyframe_distance=1.4, window=4)
    used = (resource.getrusage(who).ru_maxrss for who in _WHO)
    print(max(used) / MEBIBYTE)


_WHO = resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN


if __name__ == '__main__':
    _main(int(sys.argv[1]))
