"""A recorded drive with exact truth: scans against one map, each with a guess that is off."""

import numpy as np

from idem_ros.core.geometry import se3
from idem_ros.recording.messages import cloud_message, transform_message
from idem_ros.simulation.drive import drive, perturbed
from idem_ros.simulation.lidar import Lidar, scan

START = 10**9  # [ns]; a stamp of 0 would mean "timeless"
STEP = 10**8  # [ns] between scans
GUESS_DELAY, TRUTH_DELAY = 10**6, 2 * 10**6  # [ns]: of equal log times no format keeps the order
GUESS_ROTATION_DEG, GUESS_TRANSLATION_M = 1.5, 0.3
SCANNER = Lidar(azimuth_steps=560)
MAPPER = Lidar(azimuth_steps=1200, lowest_deg=-30.0, highest_deg=25.0, range_noise_m=0.01)
MAPPER_OFFSET_M = 1.2  # to the left of the route: another drive, on another day
# Both are coarser than what sines, norms and splines differ by from one machine to another.
RESOLUTION = 1e-3  # [m], of points
POSE_DECIMALS = 8  # of a translation [m] and a quaternion


def drive_messages(scene, scans, map_points, rng):
    """Yield (topic, log time [ns], message) of a drive along a scene's route.

    Args:
        scene: Scene with a route; its frame is that of the map.
        scans: how many.
        map_points: how many points the map is thinned to.
        rng: np.random.Generator.
    """
    target = map_of(scene, scans, map_points, rng)
    yield '/target', START, cloud_message(_rounded(target), START, 'map')
    for i, T_map_lidar in enumerate(drive(scene, scans, rng)):
        stamp = START + (i + 1) * STEP
        points = _rounded(scan(scene, T_map_lidar, SCANNER, rng))
        guess = perturbed(T_map_lidar, GUESS_ROTATION_DEG, GUESS_TRANSLATION_M, rng)
        yield '/source', stamp, cloud_message(points, stamp, 'lidar')
        for topic, delay, pose in (
            ('/initial_guess', GUESS_DELAY, guess),
            ('/ground_truth', TRUTH_DELAY, T_map_lidar),
        ):
            message = transform_message(pose, stamp, 'map', 'lidar', POSE_DECIMALS)
            yield topic, stamp + delay, message


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


def _rounded(points):
    return np.round(points / RESOLUTION) * RESOLUTION
