"""Whether the success of a solve is foretold by where its first stage ended."""

from dataclasses import replace
from typing import NamedTuple
from zlib import crc32

import numpy as np

from benchmarks.case import displaced, errors, succeeded
from idem_ros.core import Cloud, RegistrationConfig, register

STARTS = 12
FARTHEST = (180.0, 100.0)  # [deg], spacings


class Way(NamedTuple):
    """One solve, whether it succeeded, and what was foretold."""

    kind: str
    success: bool
    confidence: float


def ways(kind, build, stages=None):
    """Return the `Way` of solves from nearby to hopeless starts of one case.

    stages: radius_schedule of the solves; None: the default.
    """
    case = build()
    rng = np.random.default_rng(crc32(case.name.encode()))
    target, source = Cloud(case.target), Cloud(case.source)
    config = RegistrationConfig(voxel_size=case.voxel_size)
    if stages is not None:
        config = replace(config, radius_schedule=stages)
    found = []
    for _ in range(STARTS):
        share = rng.uniform() * rng.uniform(0.3, 1.0, 2)
        degrees, spacings = share * FARTHEST
        start = displaced(case.truth, case.centroid, degrees, spacings * case.spacing, rng)
        result = register(target, source, start, config)
        success = succeeded(case, *errors(case, result.T_target_source))
        if np.isfinite(result.confidence):
            found.append(Way(kind, success, result.confidence))
    return found
