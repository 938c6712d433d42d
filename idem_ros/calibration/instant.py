"""One instant of a rig: what each sensor saw, and where the sensors are by that alone."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idem_ros.calibration.fusion import MEETS_LITTLE
from idem_ros.core import Cloud, JointResult, Verdict, register_all
from idem_ros.core.several.joint_result import USABLE, CloudVerdict
from idem_ros.core.several.system import parts_of

SILENT = CloudVerdict(Verdict.NOT_CONVERGED, np.nan, 'it has no cloud')


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
