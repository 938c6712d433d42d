"""Whether errors lie within the covariance that was given for them: coverage and NEES."""

from typing import NamedTuple
from zlib import crc32

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.case import displaced, errors, succeeded
from idem_ros.core import Cloud, RegistrationConfig, Verdict, register

OFF = (1.5, 1.0)  # [deg], spacings, of the start
NOMINAL = {1: 68.27, 2: 95.45, 3: 99.73}  # [%] within so many standard deviations


class Spread(NamedTuple):
    """The error of one registration, in its own standard deviations."""

    kind: str
    sigmas: np.ndarray  # (6,): x y z rx ry rz
    nees: float  # normalised estimation error squared; 6 in the mean, where all is well


def spread(kind, build):
    """Return the `Spread` of one case; None where it failed, or is not called aligned."""
    case = build()
    rng = np.random.default_rng(crc32(case.name.encode()))
    target, source = Cloud(case.target), Cloud(case.source)
    config = RegistrationConfig(voxel_size=case.voxel_size)
    degrees, spacings = OFF
    start = displaced(case.truth, case.centroid, degrees, spacings * case.spacing, rng)
    result = register(target, source, start, config)
    T = result.T_target_source
    said = result.assessment
    if said.verdict is not Verdict.ALIGNED or not succeeded(case, *errors(case, T)):
        return None
    covariance = said.covariance
    turned = T[:3, :3] @ case.truth[:3, :3].T
    off = np.r_[T[:3, 3] - case.truth[:3, 3], Rotation.from_matrix(turned).as_rotvec()]
    sigmas = off / np.sqrt(np.diag(covariance))
    return Spread(kind, sigmas, float(off @ np.linalg.solve(covariance, off)))


def worst_coverage(spreads):
    """Return the largest gap between coverage and its nominal, over axes and sigmas [points]."""
    sigmas = np.abs([each.sigmas for each in spreads])
    return max(
        abs(100 * float(share) - nominal)
        for k, nominal in NOMINAL.items()
        for share in np.mean(sigmas < k, axis=0)
    )


def within(spreads, sigmas):
    """Return the share [%] of errors within so many standard deviations, axis by axis, (6,)."""
    off = np.abs([each.sigmas for each in spreads])
    return 100 * np.mean(off < sigmas, axis=0)
