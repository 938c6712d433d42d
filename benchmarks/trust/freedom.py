"""Whether free motions are found, and stay as they were guessed."""

from typing import NamedTuple
from zlib import crc32

import numpy as np
from scipy.linalg import subspace_angles

from benchmarks.bare_scenes import BARE_SCENES, bare_case
from benchmarks.case import displaced
from idem_ros.core import RegistrationConfig, register
from idem_ros.core.geometry import se3

OFF = (1.0, 0.05)  # [deg], [m], of the start
VOXELS = (None, 0.15)
RIGHT_DEG = 5.0  # between the subspace that was found and the true one


class Freedom(NamedTuple):
    """One registration in a bare scene."""

    scene: str
    found: bool  # the right subspace
    drift: float  # along the free motions, guess to result, as the surfaces move [m]


def freedom(name, seed):
    """Return the `Freedom` of one trial."""
    case = bare_case(name, seed, VOXELS[seed % len(VOXELS)])
    rng = np.random.default_rng(crc32(case.name.encode()))
    start = displaced(case.truth, case.centroid, *OFF, rng)
    config = RegistrationConfig(voxel_size=case.voxel_size)
    result = register(case.target, case.source, start, config)
    arm = float(np.sqrt(np.mean(np.sum(case.target**2, axis=1))))
    scale = np.repeat([1.0, arm], 3)
    free = np.array(BARE_SCENES[name][1]).reshape(-1, 6)[:, se3.ROS_ORDER]
    found = len(free) == len(result.free_motions)
    if found and len(free):
        angles = subspace_angles((free * scale).T, (result.free_motions * scale).T)
        found = bool(np.degrees(angles.max()) < RIGHT_DEG)
    moved = se3.log(result.T_target_source @ se3.inverse(start))[se3.ROS_ORDER] * scale
    along = np.linalg.norm(free / np.maximum(np.abs(free).max(axis=1, keepdims=True), 1) @ moved)
    return Freedom(name, found, float(along) if len(free) else 0.0)
