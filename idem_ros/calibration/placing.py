"""Sensors put in place from starts up to 45 deg and 0.5 m off: one after the other, many tries.

Each is registered at coarse voxels to the union of those in place, as it starts and turned about
many axes; the verdict, and how many tries end in one place, choose among them, and who is next.
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
# Voxels, over those that all are calibrated by, and the last of the stages: wide balls find what
# is far, and draw clouds that meet at their rims over one another.
TRIED = (3.0, 4), (1.5, 3)
LEAST_OVERLAP = 0.05
SAME_M, SAME_DEG = 0.1, 1.0  # tries that end so near end in one place


def placed(instant, starts, config):
    """Return poses (S, 4, 4) from which the sensors of an `Instant` can be solved at once.

    Args:
        instant: `Instant`, in which the reference has a cloud.
        starts: (S, 4, 4), in the frame of the reference.
        config: `RegistrationConfig` that the solve is by.
    """
    size, wide = config.voxel_size, config.radius_schedule
    coarse = [
        replace(config, voxel_size=size and coarser * size, radius_schedule=wide[-stages:])
        for coarser, stages in TRIED
    ]
    poses, in_place = np.array(starts, dtype=np.float64), [0]
    while waiting := [s for s in instant.heard if s not in in_place]:
        union = _union(instant, poses, in_place)
        for turns in (_turns()[:1], _turns()):  # who needs no other start is quickly in place
            tries = [
                (_best(union, instant.clouds[s], poses[s], turns, coarse), s) for s in waiting
            ]
            (p, pose), chosen = max(tries, key=lambda each: each[0][0])
            if p >= 1.0 + LEAST_PROBABILITY:  # of both, in one place
                break
        if pose is not None:
            poses[chosen] = pose
        in_place.append(chosen)
    return poses


def _best(target, source, start, turns, configs):
    """Return (score, pose) of the likeliest of the tries that end near enough; or (0, None).

    The score is the probability that it is right, and the share of the tries that end there.
    """
    ends = []
    for turn, config in itertools.product(turns, configs):
        result = register(target, source, start @ turn, config)
        pose = result.T_target_source
        if result.overlap >= LEAST_OVERLAP and is_within(pose, start, REACH_M, REACH_DEG):
            assert result.assessment is not None, 'verdicts are asked for'
            ends.append((np.nan_to_num(result.assessment.p_aligned), pose))
    scored = [(p + _share(pose, ends, len(turns) * len(configs)), pose) for p, pose in ends]
    return max(scored, key=lambda each: each[0], default=(0.0, None))


def _share(pose, ends, count):
    return sum(is_within(end, pose, SAME_M, SAME_DEG) for _, end in ends) / count


def is_within(pose, other, metres, degrees):
    """Return whether two (4, 4) poses in one frame are no farther apart."""
    turned = np.degrees(se3.rotation_angle(se3.inverse(other) @ pose))
    return turned <= degrees and np.linalg.norm(pose[:3, 3] - other[:3, 3]) <= metres


def _turns():
    """Return the (4, 4) turns that are tried; the first is none."""
    turns = [np.eye(4)]
    for axis in itertools.product((-1, 0, 1), repeat=3):
        if (degrees := TURNS_DEG.get(int(np.count_nonzero(axis)))) is not None:
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
