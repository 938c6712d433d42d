"""A rig held against its extrinsics, instant by instant."""

from collections import deque
from dataclasses import replace
from typing import NamedTuple

from idem_ros.calibration.fusion import Drift, covariances_of, drift_of
from idem_ros.calibration.initial_extrinsics import starts_of
from idem_ros.calibration.rig_calibration import combined
from idem_ros.calibration.rig_motion import step_between
from idem_ros.calibration.synchronized_scans import calibrate_sightings
from idem_ros.core.several.joint_result import USABLE, CloudVerdict


class Watched(NamedTuple):
    """What the last instants say of one sensor."""

    name: str
    verdict: CloudVerdict
    drift: Drift | None
    """None: they do not tell where it is."""


class RigWatch:
    """Fuses the last instants of a rig, and says how far its sensors are from where they were.

    Args:
        tree: `FrameTree` of where they were.
        kept: how many instants are made one.
    """

    def __init__(self, tree, kept):
        self._tree, self._names = tree, None
        self._found, self._steps = deque(maxlen=kept), deque(maxlen=max(kept - 1, 1))
        self._voxel_size = None

    def forget(self):
        """Begin anew: the clouds are prepared or registered otherwise from now on."""
        self._names = None

    def take(self, sighting, names, config):
        """Return `Watched` of each sensor but the reference, with one more instant.

        Args:
            sighting: `Sighting`.
            names: of its sensors; where they are others than before, it begins anew.
            config: `RegistrationConfig`.

        Raises:
            UnknownStart: the extrinsics do not say where one is.
            Uncalibrated: the reference, or all others, were silent.
            OtherUnits: see `calibrate_sightings`.
        """
        starts, before = starts_of(self._tree, names), covariances_of(self._tree, names)
        if names != self._names:
            self._found.clear()
            self._steps.clear()
            self._names, self._voxel_size = names, config.voxel_size
        config = replace(config, voxel_size=self._voxel_size)  # chosen once, where it is auto
        calibrated, _ = calibrate_sightings([sighting], names, starts, config)
        self._voxel_size = calibrated.voxel_size
        config = replace(config, voxel_size=self._voxel_size)
        (newest,) = calibrated.instants
        if self._found:
            clouds = (each.instant.clouds[0] for each in (self._found[-1], newest))
            self._steps.append(step_between(*clouds, config))
        self._found.append(newest)
        steps = list(self._steps)[: len(self._found) - 1]
        sensors = combined(list(self._found), steps, config)
        rows = list(zip(names, sensors, starts, before, strict=True))[1:]
        return [_watched(*row) for row in rows]


def _watched(name, found, start, covariance):
    tells = found.agreeing and found.verdict.verdict in USABLE
    drift = drift_of(name, found, start, covariance) if tells else None
    return Watched(name, found.verdict, drift)
