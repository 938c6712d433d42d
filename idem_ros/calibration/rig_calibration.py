"""Calibrate a rig: each instant solved at once, from starts that are far off, all made one."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from idem_ros.calibration.fusion import MEETS_LITTLE, Fused, contradiction, fused
from idem_ros.calibration.placing import REACH_DEG, REACH_M, is_within, placed
from idem_ros.calibration.rig_motion import independent, step_between
from idem_ros.core import Cloud, IdemError, JointResult, Verdict, register_all
from idem_ros.core.metric.voxel_size import size_found, with_voxel_size
from idem_ros.core.several.joint_result import USABLE, CloudVerdict
from idem_ros.core.several.system import parts_of

SILENT = CloudVerdict(Verdict.NOT_CONVERGED, np.nan, 'it has no cloud')
NEAR = 2  # stages
UNKNOWN = 0.25  # probability of what no verdict tells of: what is wrong has a tenth at most
TRIED = 3  # instants that are looked at for where the sensors are, about


@dataclass(frozen=True, eq=False)
class Instant:
    """What the sensors of a rig saw at one time."""

    name: str
    clouds: tuple[Cloud | None, ...]
    """Of each sensor, in its own frame, the reference's first; None: it was silent."""
    by_motion: NDArray[np.float64] | None = None
    """(S, 6, 6) of the sensors' poses by what is not known of the motion; None: it stood."""

    @property
    def heard(self):
        """Numbers of the sensors that have a cloud."""
        return [s for s, cloud in enumerate(self.clouds) if cloud is not None]


@dataclass(frozen=True, eq=False)
class Solved:
    """Where the sensors are by one instant."""

    instant: Instant
    poses: NDArray[np.float64]
    """(S, 4, 4) in the frame of the reference; where it started of a sensor without a cloud."""
    covariances: NDArray[np.float64]
    """(S, 6, 6) x y z rx ry rz of each, in the axes of the reference."""
    verdicts: tuple[CloudVerdict, ...]
    meets: tuple[bool, ...]
    """Whether each hangs together with the reference, by pairs that meet enough to tell."""
    result: JointResult | None
    """Of the sensors that were heard; None: there were not two."""
    contradiction: float = 1.0
    """What the covariances were multiplied by, see `contradiction`."""

    @property
    def usable(self):
        """Whether each sensor's pose can be built upon, (S,)."""
        return [
            said.verdict in USABLE and meets
            for said, meets in zip(self.verdicts, self.meets, strict=True)
        ]

    @property
    def is_usable(self):
        """Whether all of those that were heard can be built upon."""
        return self.result is not None and all(self.usable[s] for s in self.instant.heard)


def solved(instant, starts, config):
    """Return the `Solved` of an `Instant` from starts (S, 4, 4); the reference is held."""
    heard, count = instant.heard, len(instant.clouds)
    poses, verdicts, meets = np.array(starts, dtype=np.float64), [SILENT] * count, [False] * count
    covariances = np.zeros((count, 6, 6))
    if len(heard) < 2 or heard[0] != 0:
        return Solved(instant, poses, covariances, tuple(verdicts), tuple(meets), None)
    result = register_all([instant.clouds[s] for s in heard], poses[heard], config, held=[0])
    together = _together(result, len(heard))
    for k, s in enumerate(heard):
        poses[s] = result.poses[k]
        covariances[s] = result.covariance[6 * k : 6 * k + 6, 6 * k : 6 * k + 6]
        verdicts[s], meets[s] = result.verdicts[k], bool(together[k]) and together.sum() > 1
    return Solved(instant, poses, covariances, tuple(verdicts), tuple(meets), result)


def _together(result, count):
    """Return which clouds hang together with the first, (count,)."""
    told = [(edge.i, edge.j) for edge in result.edges if edge.verdict not in MEETS_LITTLE]
    part = parts_of(np.array(told, int).reshape(-1, 2), count)
    return part == part[0]


class Uncalibrated(IdemError):
    """Instants of which nothing can be calibrated; it says what they lack."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """The sensors of a rig in the frame of its reference, the first of them."""

    sensors: tuple[Fused, ...]
    instants: tuple[Solved, ...]
    starts: NDArray
    """(S, 4, 4) that they were looked for from."""
    steps: tuple
    """`RegistrationResult` of the reference from each instant to the next; None: unknown."""
    voxel_size: float | None

    @property
    def usable(self):
        """Whether the pose of each sensor can be built upon, (S,)."""
        return [each.verdict.verdict in USABLE for each in self.sensors]

    @property
    def is_usable(self):
        """Whether all can be built upon."""
        return all(self.usable)

    @property
    def poses(self):
        """The (4, 4) poses of the sensors in the frame of the reference."""
        return [each.pose for each in self.sensors]


def calibrate(instants, starts, config):
    """Return the `Calibration` of a rig.

    Args:
        instants: `Instant`s, the reference's cloud the first of each; one at least in which it
            and another sensor have a cloud.
        starts: (S, 4, 4) sensors in the frame of the reference, up to 45 deg and 0.5 m off.
        config: `RegistrationConfig`.

    Raises:
        Uncalibrated: no instant has a cloud of the reference and of another sensor.
    """
    used = [each for each in instants if 0 in each.heard and len(each.heard) > 1]
    if not used:
        raise Uncalibrated('no instant has a cloud of the reference and of another sensor')
    config = with_voxel_size(config, *(c for each in used for c in each.clouds if c is not None))
    leader, near = _leader(used, starts, config), _near(config)
    found = [
        leader if each is leader.instant else solved(each, leader.poses, near) for each in used
    ]
    found = [_with_contradiction(each, near) for each in found]
    steps = [
        step_between(first.clouds[0], second.clouds[0], config) for first, second in pairwise(used)
    ]
    sensors = combined(found, steps, config)
    return Calibration(sensors, tuple(found), starts, tuple(steps), size_found(config))


def combined(found, steps, config):
    """Return the `Fused` of each sensor.

    Args:
        found: `Solved` of each instant.
        steps: `RegistrationResult` of the reference from each to the next; None: unknown.
        config: `RegistrationConfig`, of the voxels that they were solved with.
    """
    as_good_as = independent(steps, size_found(config) or 0.0)
    numbers = range(len(found[0].poses))
    sensors = tuple(fused(found, s, config.audit_tolerance, as_good_as) for s in numbers)
    said = sensors[0].verdict
    if said.verdict not in MEETS_LITTLE:
        return sensors
    # what the others say of one another is nothing in the frame of the reference
    said = replace(said, reason=f'the reference is not: {said.reason}')
    return sensors[0], *(
        each._replace(verdict=said) if each.verdict.verdict in USABLE else each
        for each in sensors[1:]
    )


def _with_contradiction(each, config):
    """Return a `Solved` whose covariances hold what its pairs contradict each other by."""
    if each.result is None:
        return each
    clouds = [each.instant.clouds[s] for s in each.instant.heard]
    more = contradiction(clouds, each.result, config)
    return replace(each, covariances=more * each.covariances, contradiction=more)


def _leader(instants, starts, config):
    """Return the `Solved` that is believed most: at once where one is, else after more tries."""
    tried = []
    for each in _spread_out(instants):
        tried.append(solved(each, starts, config))
        if tried[-1].is_usable:
            return tried[-1]
    for each in list(tried):
        poses = placed(each.instant, starts, config)
        tried.append(solved(each.instant, poses, _near(config)))
        if tried[-1].is_usable:
            return tried[-1]
    return max(reversed(tried), key=lambda each: _score(each, starts))


def _score(each, starts):
    """Return how well an instant is believed: probabilities of its sensors, summed.

    Of those that meet others, and are not farther from their starts than any start is off.
    """
    return sum(
        np.nan_to_num(said.p_aligned, nan=UNKNOWN)
        for said, meets, pose, start in zip(
            each.verdicts, each.meets, each.poses, starts, strict=True
        )
        if meets and is_within(pose, start, REACH_M, REACH_DEG)
    )


def _spread_out(instants):
    """Return `TRIED` of the instants that most sensors have a cloud in."""
    most = max(len(each.heard) for each in instants)
    full = [each for each in instants if len(each.heard) == most]
    return full[:: max(len(full) // TRIED, 1)][:TRIED]


def _near(config):
    """Return the `RegistrationConfig` from poses that are nearly right: no wide stages."""
    return replace(config, radius_schedule=config.radius_schedule[-NEAR:])
