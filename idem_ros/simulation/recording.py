"""A recorded drive with exact truth: scans against one map, each with a guess that is off."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.geometry import se3
from idem_ros.recording.messages import cloud_message, transform_message
from idem_ros.simulation.drive import drive, moving_drive, perturbed
from idem_ros.simulation.lidar import Lidar, moving_scan, scan

START = 10**9  # [ns]; a stamp of 0 would mean "timeless"
STEP = 10**8  # [ns] between scans
GUESS_DELAY, TRUTH_DELAY = 10**6, 2 * 10**6  # [ns]: of equal log times no format keeps the order
GUESS_ROTATION_DEG, GUESS_TRANSLATION_M = 1.5, 0.3
SCANNER = Lidar(azimuth_steps=560)
MAPPER = Lidar(azimuth_steps=1200, lowest_deg=-30.0, highest_deg=25.0, range_noise_m=0.01)
MAPPER_OFFSET_M = 1.2  # to the left of the route: another drive, on another day
MAPPED_STOPS = 21  # along the route, of the drive that makes the map
ODOMETRY_ERROR = 0.05  # standard deviation, of what was moved
# Both are coarser than what sines, norms and splines differ by from one machine to another.
RESOLUTION = 1e-3  # [m], of points
POSE_DECIMALS = 8  # of a translation [m] and a quaternion


class Motion(NamedTuple):
    """How a sensor drives."""

    speed: float  # [m/s]
    turn_rate: float = 0.0  # [rad/s], at most, beside the route's own
    sweep_s: float = 0.1  # [s]: what a scan takes


def drive_messages(scene, scans, map_points, rng):
    """Yield (topic, log time [ns], message) of a drive along a scene's route.

    Args:
        scene: Scene with a route; its frame is that of the map.
        scans: how many.
        map_points: how many points the map is thinned to.
        rng: np.random.Generator.
    """
    target = map_of(scene, scans, map_points, rng)
    yield '/target', START, cloud_message(rounded(target), START, 'map')
    yield from scan_messages(
        drive(scene, scans, rng), lambda pose: scan(scene, pose, SCANNER, rng), rng
    )


def scan_messages(poses, scan_at, rng):
    """Yield (topic, log time [ns], message) of a scan, a guess and the truth at each pose.

    Args:
        poses: (N, 4, 4) T_map_lidar.
        scan_at: gives the points that the sensor sees at a pose, in its frame.
        rng: np.random.Generator, of the guesses.
    """
    for i, T_map_lidar in enumerate(poses):
        stamp = START + (i + 1) * STEP
        points = rounded(scan_at(T_map_lidar))
        guess = perturbed(T_map_lidar, GUESS_ROTATION_DEG, GUESS_TRANSLATION_M, rng)
        yield '/source', stamp, cloud_message(points, stamp, 'lidar')
        yield posed('/initial_guess', stamp, GUESS_DELAY, guess)
        yield posed('/ground_truth', stamp, TRUTH_DELAY, T_map_lidar)


def moving_messages(scene, motion, scans, map_points, rng):
    """Yield (topic, log time [ns], message) of a drive without a halt, scanned sweep after sweep.

    A scan's stamp is the begin of its sweep, and its field `time` tells when each point was
    measured. The guesses are an odometry's: off by as much as in `drive_messages` at the first
    scan, and from scan to scan by `ODOMETRY_ERROR` of what it moved. The truth is told at the
    begin of each sweep and at the end of the last; between two, the sensor moves by one twist.

    Args:
        scene: Scene with a route; its frame is that of the map.
        motion: `Motion`.
        scans: how many.
        map_points: how many points the map is thinned to.
        rng: np.random.Generator.
    """
    target = map_of(scene, MAPPED_STOPS, map_points, rng)
    yield '/target', START, cloud_message(rounded(target), START, 'map')
    poses, twists = moving_drive(scene, scans, rng, *motion)
    guess = perturbed(poses[0], GUESS_ROTATION_DEG, GUESS_TRANSLATION_M, rng)
    takes = round(1e9 * motion.sweep_s)
    for i, (pose, twist) in enumerate(zip(poses, twists, strict=False)):
        stamp = START + takes * (i + 1)
        seen, times = moving_scan(scene, pose, twist, motion.sweep_s, SCANNER, rng)
        columns = {'time': times.astype(np.float32)}
        yield '/source', stamp, cloud_message(rounded(seen), stamp, 'lidar', columns=columns)
        yield posed('/initial_guess', stamp, GUESS_DELAY, guess)
        yield posed('/ground_truth', stamp, TRUTH_DELAY, pose)
        told = motion.sweep_s * twist * (1.0 + ODOMETRY_ERROR * rng.normal(size=6))
        guess = guess @ se3.exp(told[se3.ROS_ORDER])
    stamp = START + takes * (scans + 1)
    yield posed('/initial_guess', stamp, GUESS_DELAY, guess)
    yield posed('/ground_truth', stamp, TRUTH_DELAY, poses[-1])


def posed(topic, stamp, delay, pose):
    """Return (topic, log time [ns], message) of a pose of the sensor at a stamp."""
    message = transform_message(pose, stamp, 'map', 'lidar', POSE_DECIMALS)
    return topic, stamp + delay, message


def map_of(scene, scans, map_points, rng):
    """Return (map_points, 3) points of a drive of its own, in the scene's frame [m].

    No scan's points are in it: the sensor, its path and its noise are others.
    """
    seen = [
        se3.transform_points(pose, scan(scene, pose, MAPPER, rng))
        for pose in drive(scene, scans, rng, lateral_m=MAPPER_OFFSET_M)
    ]
    points = np.concatenate(seen)
    return points[_evenly(points, map_points, rng)]


def _evenly(points, count, rng):
    """Choose points at random, one from each cell first: the near ground is seen too often."""
    cells = np.floor(points / 0.25).astype(np.int64)
    order = rng.permutation(len(points))
    _, first = np.unique(cells[order], axis=0, return_index=True)
    chosen = order[np.sort(first)]
    if len(chosen) < count:
        rest = np.setdiff1d(order, chosen, assume_unique=True)
        chosen = np.concatenate([chosen, rng.permutation(rest)[: count - len(chosen)]])
    return np.sort(chosen[:count])


def rounded(points):
    """Return points as they are recorded: alike on every machine."""
    return np.round(points / RESOLUTION) * RESOLUTION
