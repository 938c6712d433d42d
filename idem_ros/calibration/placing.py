"""Sensors put in place from starts up to 45 deg and 0.5 m off: one after the other, many tries.

Each is registered at coarse voxels to the union of those in place, as it starts and turned about
many axes; the verdict chooses among the tries, and who is placed next.
"""

import itertools
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from idem_ros.core import Cloud, register
from idem_ros.core.geometry import se3
from idem_ros.core.trust.verdict import LEAST_PROBABILITY

TURNS_DEG = {1: 30.0, 3: 42.0}  # by how many axes it is about at once: fills a ball of 45 deg
REACH_DEG, REACH_M = 60.0, 1.5  # what ends farther from its start is another valley
NARROW = 3  # stages
COARSER = 3.0  # voxels, than those that all are calibrated by


def placed(instant, starts, config):
    """Return poses (S, 4, 4) from which the sensors of an `Instant` can be solved at once.

    Args:
        instant: `Instant`, in which the reference has a cloud.
        starts: (S, 4, 4), in the frame of the reference.
        config: `RegistrationConfig` that the solve is by.
    """
    size, wide = config.voxel_size, config.radius_schedule
    # clouds that meet at their rims are drawn over one another by wide balls, and found by them
    coarse = [
        replace(config, voxel_size=size and COARSER * size, radius_schedule=each)
        for each in dict.fromkeys((wide, wide[-NARROW:]))
    ]
    poses, in_place = np.array(starts, dtype=np.float64), [0]
    while waiting := [s for s in instant.heard if s not in in_place]:
        union = _union(instant, poses, in_place)
        for turns in (_turns()[:1], _turns()):  # who needs no other start is quickly in place
            tries = [
                (_best(union, instant.clouds[s], poses[s], turns, coarse), s) for s in waiting
            ]
            (p, pose), chosen = max(tries, key=lambda each: each[0][0])
            if p >= LEAST_PROBABILITY:
                break
        if pose is not None:
            poses[chosen] = pose
        in_place.append(chosen)
    return poses


def _best(target, source, start, turns, configs):
    """Return (p, pose) of the try that is likeliest right, near enough to its start; or None."""
    found = -1.0, None
    for turn, config in itertools.product(turns, configs):
        result = register(target, source, start @ turn, config)
        pose, p = result.T_target_source, result.assessment.p_aligned
        if p == p and p > found[0] and _is_near(pose, start):
            found = p, pose
    return found


def _is_near(pose, start):
    degrees = np.degrees(se3.rotation_angle(se3.inverse(start) @ pose))
    return degrees <= REACH_DEG and np.linalg.norm(pose[:3, 3] - start[:3, 3]) <= REACH_M


def _turns():
    """Return the (4, 4) turns that are tried; the first is none."""
    turns = [np.eye(4)]
    for axis in itertools.product((-1, 0, 1), repeat=3):
        if (degrees := TURNS_DEG.get(np.count_nonzero(axis))) is not None:
            turn, direction = np.eye(4), np.array(axis) / np.linalg.norm(axis)
            turn[:3, :3] = Rotation.from_rotvec(np.radians(degrees) * direction).as_matrix()
            turns.append(turn)
    return turns


def _union(instant, poses, numbers):
    clouds = [instant.clouds[s] for s in numbers]
    return Cloud(
        np.concatenate(
            [
                se3.transform_points(poses[s], cloud.points + cloud.origin)
                for s, cloud in zip(numbers, clouds, strict=True)
            ]
        )
    )
