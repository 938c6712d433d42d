"""Recordings for `idem smooth`: rounds of a block of a town, and a long way over open ground."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from idem_ros.core.geometry import se3
from idem_ros.files.pose_file import write_tum
from idem_ros.recording.messages import cloud_message
from idem_ros.recording.writer import write_mcap
from idem_ros.simulation.drive import drive, perturbed
from idem_ros.simulation.lidar import Lidar, scan
from idem_ros.simulation.street import LANE
from idem_ros.simulation.surfaces import Scene
from idem_ros.simulation.town import BLOCK, Town, street_corners

START, STEP = 10**9, 10**8  # [ns]
BLOCKS, ROUNDS = 5, 2
STEP_DEG, STEP_M = 0.1, 0.03  # by which each step of the odometry is off, exactly
LIDAR = Lidar(azimuth_steps=560)
SMALL_POINTS, SMALL_REACH = 300, 8.0  # of a small scan, [m]


class Recorded(NamedTuple):
    """A recording and what is known of it."""

    recording: str
    trajectory: str
    truth: np.ndarray  # (N, 4, 4), in the frame of the first scan
    odometry: np.ndarray  # likewise


def rounds(folder, seed, scans):
    """Write a drive of two rounds about a block of a town; return it as `Recorded`."""
    rng, town = np.random.default_rng(seed), Town(seed, BLOCKS)
    low, high = BLOCKS // 2, BLOCKS // 2 + 1
    corners = [(low, low), (high, low), (high, high), (low, high)] * ROUNDS
    xy = street_corners(np.array([*corners, (low, low)], float) * BLOCK)
    route = np.column_stack([xy, town.height(*xy.T)])
    world = drive(Scene(route=route), scans, rng, lateral_m=LANE)
    truth = np.array([se3.inverse(world[0]) @ T for T in world])

    def points():
        """Yield what is seen from each pose."""
        for T in world:
            yield scan(town.near(T[:3, 3], LIDAR.max_range_m), T, LIDAR, rng)

    odometry = drifted(truth, np.random.default_rng([seed, 1]))
    return _written(folder, points(), truth, odometry)


def ground(folder, seed, scans):
    """Write a drive over rough ground, of small scans that cost little; as `Recorded`."""
    rng = np.random.default_rng(seed)
    along = 0.5 * np.arange(scans)
    truth = []
    for s in along:
        turn = se3.exp(np.array([0.0, 0.0, 0.3 * np.sin(s / 20.0), 0.0, 0.0, 0.0]))
        turn[:3, 3] = s, 6.0 * (1.0 - np.cos(s / 20.0)), 1.0
        truth.append(turn)
    truth = np.array([se3.inverse(truth[0]) @ T for T in truth])
    origin = se3.translation(np.array([0.0, 0.0, 1.0]))

    def points():
        """Yield what is seen from each pose: ground in a disc, rough at some wavelengths."""
        for T in truth:
            r = SMALL_REACH * np.sqrt(rng.random(SMALL_POINTS))
            turn = rng.uniform(0.0, 2 * np.pi, SMALL_POINTS)
            place = (origin @ T)[:2, 3] + np.column_stack([r * np.cos(turn), r * np.sin(turn)])
            world = np.column_stack([place, _height(*place.T)])
            yield se3.transform_points(se3.inverse(origin @ T), world)

    return _written(folder, points(), truth, drifted(truth, np.random.default_rng([seed, 1])))


def drifted(truth, rng):
    """Return poses whose steps are off by `STEP_DEG` and `STEP_M`, in any direction."""
    poses = [truth[0]]
    for before, after in zip(truth[:-1], truth[1:], strict=True):
        step = perturbed(se3.inverse(before) @ after, STEP_DEG, STEP_M, rng)
        poses.append(poses[-1] @ step)
    return np.array(poses)


def _height(x, y):
    return 0.5 * np.sin(1.1 * x + 0.4 * y) * np.cos(0.9 * y) + 0.8 * np.sin(0.5 * x - 0.7 * y)


def _written(folder, points, truth, odometry):
    stamps = [START + k * STEP for k in range(len(truth))]
    recording, trajectory = (str(Path(folder) / name) for name in ('drive.mcap', 'drive.tum'))
    messages = (
        ('/scan', stamp, cloud_message(each, stamp, 'lidar'))
        for stamp, each in zip(stamps, points, strict=True)
    )
    write_mcap(recording, messages)
    write_tum(trajectory, stamps, odometry)
    return Recorded(recording, trajectory, truth, odometry)
