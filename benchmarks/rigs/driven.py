"""Rigs that drive while they look: errors, and whether the covariances hold over short ways."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from benchmarks.goal import Goal
from benchmarks.rigs.measure import Error, error_of
from benchmarks.rigs.scenes import FIRST_SEED
from idem_ros.calibration.initial_extrinsics import starts_of
from idem_ros.calibration.recorded_sightings import cloud_topics, recorded_rig, sightings_in
from idem_ros.calibration.sighting_messages import preparing
from idem_ros.calibration.synchronized_scans import calibrate_sightings
from idem_ros.messages.transform_message import matrix_of
from idem_ros.recording.reader import open_recording
from idem_ros.recording.writer import write_mcap
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.simulation.recording import Motion
from idem_ros.simulation.rig import rig_messages
from idem_ros.simulation.street import street
from idem_ros.terminal.markdown import number, table

LIDARS, INSTANTS, TURN_DEG = 3, 5, 20.0
LEAST_NEES, MOST_NEES = 0.3, 1.5


class Drive(NamedTuple):
    """How a rig drives."""

    scans: int
    speed: float  # [m/s]

    def __str__(self):
        return f'{self.speed:g} m/s over {self.speed * self.scans / 10:g} m'


DRIVES = Drive(12, 2.0), Drive(12, 5.0), Drive(40, 10.0)


def measure_drives(config, trials, progress=iter):
    """Return {drive: [`Error`]} of every sensor of every rig but the reference."""
    found = {drive: [] for drive in DRIVES}
    for trial in progress(range(trials)):
        for drive in DRIVES:
            found[drive] += _errors(drive, trial, config)
    return found


def drive_goals(found):
    """Return the `Goal`s: squared errors are as promised."""
    goals = []
    for drive, errors in found.items():
        nees = float(np.mean([each.nees for each in errors]))
        goals.append(Goal(f'{drive}: NEES, mean', nees, MOST_NEES))
        goals.append(Goal(f'{drive}: NEES, mean, inverse', 1.0 / nees, 1.0 / LEAST_NEES))
    return goals


def drives_table(found):
    """Return the errors as a Markdown table."""
    rows = [
        [
            str(drive),
            len({each.trial for each in errors}),
            len(errors),
            *(
                f'{number(1e3 * np.quantile([each.metres for each in errors], share))} mm, '
                f'{number(np.quantile([each.degrees for each in errors], share))} deg'
                for share in (0.5, 0.9)
            ),
            number(np.median([each.nees for each in errors])),
            number(np.mean([each.nees for each in errors])),
        ]
        for drive, errors in found.items()
    ]
    heads = 'drive', 'rigs', 'sensors', 'median', 'p90', 'NEES, median', 'NEES, mean'
    return table(heads, rows, left=1)


def _errors(drive, trial, config) -> list[Error]:
    rng = np.random.default_rng([FIRST_SEED + trial, DRIVES.index(drive)])
    motion = Motion(drive.speed, np.radians(TURN_DEG))
    with TemporaryDirectory() as folder:
        path = Path(folder) / 'rig.mcap'
        write_mcap(path, rig_messages(street(rng), LIDARS, motion, drive.scans, rng))
        with open_recording(path) as recording:
            rig = recorded_rig(recording, cloud_topics(recording, None))
            prepare = preparing(PreprocessingConfig())
            sightings = sightings_in(recording, rig, INSTANTS, PointTimeConfig(), prepare)
            truth = [matrix_of(each) for _, _, each in recording.messages(['/ground_truth'])]
    starts = starts_of(rig.tree, rig.names)
    found, _ = calibrate_sightings(sightings, rig.names, starts, config)
    return [error_of(each, T, trial) for each, T in zip(found.sensors[1:], truth, strict=True)]
