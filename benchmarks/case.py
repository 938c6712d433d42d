"""One registration with a known answer: two clouds, the truth, and where solvers start."""

from dataclasses import dataclass
from functools import cached_property
from zlib import crc32

import numpy as np
from scipy.spatial.transform import Rotation

from idem_ros.core import Cloud, search_radius
from idem_ros.replay.frames import rotation_error_deg

LEVELS = ((1, 2.0), (2, 5.0), (4, 10.0), (8, 15.0))
"""(multiple of the spacing, degrees) that starts are off the truth."""


@dataclass(frozen=True, eq=False)
class Case:
    """Two clouds to register, and where the source truly is.

    Attributes:
        name: unique among all cases; the starts are drawn from it.
        target: (N, 3) raw points in the target frame [m].
        source: (M, 3) raw points in the source frame [m].
        truth: (4, 4) T_target_source.
        voxel_size: every method reduces both clouds to these voxels [m]; None: none does.
        truth_rotation_deg: how far the truth itself may be off [deg].
        truth_translation_m: how far the truth itself may be off [m].
    """

    name: str
    target: np.ndarray
    source: np.ndarray
    truth: np.ndarray
    voxel_size: float | None = None
    truth_rotation_deg: float = 0.0
    truth_translation_m: float = 0.0

    @cached_property
    def spacing(self):
        """The common r4th of the clouds that are registered (Eq. 9 at a = 1) [m]."""
        clouds = Cloud(self.target), Cloud(self.source)
        if self.voxel_size is not None:
            clouds = tuple(cloud.reduced(self.voxel_size) for cloud in clouds)
        return search_radius(*clouds)

    @cached_property
    def centroid(self):
        """The source's centroid in its own frame, (3,) [m]."""
        return self.source.mean(axis=0)


def starts(case, level, count):
    """Return `count` guesses that are off by exactly a level; the same in every run.

    The source turns about its centroid, about a random axis; the centroid moves in a random
    direction.

    Args:
        case: Case.
        level: (multiple of the spacing, degrees), one of `LEVELS`.
        count: how many.

    Returns:
        list of (4, 4) T_target_source.
    """
    multiple, degrees = level
    rng = np.random.default_rng([crc32(case.name.encode()), int(multiple)])
    return [
        displaced(case.truth, case.centroid, degrees, multiple * case.spacing, rng)
        for _ in range(count)
    ]


def displaced(T, center, degrees, distance, rng):
    """Return T with the source turned about `center` (3,) and `center` moved, by these amounts."""
    axis, direction = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    start = np.eye(4)
    start[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(np.radians(degrees) * axis).as_matrix()
    moved = T[:3, :3] @ center + T[:3, 3] + distance * direction
    start[:3, 3] = moved - start[:3, :3] @ center
    return start


def errors(case, T):
    """Return the angle [deg] and the distance of the source's centroid [m] off the truth."""
    if not np.isfinite(T).all():
        return 180.0, np.inf
    off = (T[:3, :3] - case.truth[:3, :3]) @ case.centroid + T[:3, 3] - case.truth[:3, 3]
    return rotation_error_deg(T, case.truth), float(np.linalg.norm(off))


def succeeded(case, rotation_deg, translation_m):
    """Whether errors are below 1 deg and half the spacing."""
    return rotation_deg < 1.0 and translation_m < 0.5 * case.spacing


def displacement(case, rotation_deg, translation_m):
    """Return both errors as one: about how far they move the source's points, in spacings."""
    reach = np.sqrt(np.mean(np.sum((case.source - case.centroid) ** 2, axis=1)))
    return float(np.hypot(translation_m, np.radians(rotation_deg) * reach) / case.spacing)


@dataclass(frozen=True)
class Unseen:
    """One case to be, of a group whose cases are pooled.

    Attributes:
        group: its name.
        build: function without arguments that returns the `Case`, picklable.
        right: (degrees, length) below which a result is right; None: `succeeded` tells.
    """

    group: str
    build: object
    right: tuple | None = None

    @property
    def is_exact(self):
        """Whether the truth is: that of real scans is not."""
        return self.right is None

    def is_right(self, case, rotation_deg, translation_m):
        """Whether errors of the case that was built are below the limits."""
        if self.right is None:
            return succeeded(case, rotation_deg, translation_m)
        return rotation_deg < self.right[0] and translation_m < self.right[1]
