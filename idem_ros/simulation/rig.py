"""Several LiDARs on one rig: where each is mounted, and what they see from there."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from idem_ros.core.geometry.se3 import ROS_ORDER, adjoint, exp, inverse
from idem_ros.recording.messages import cloud_message, tf_message, transform_message
from idem_ros.simulation.drive import drive, moving_drive, perturbed
from idem_ros.simulation.lidar import Lidar, moving_scan, scan
from idem_ros.simulation.recording import POSE_DECIMALS, START, STEP, rounded

SPREAD_M = (0.8, 0.6, 0.3)  # of the mounts about the middle of the rig: a car's roof
TILT_DEG = 8.0
FULL_DEG, SHARED = 360.0, 1.9  # of the horizon; what each sees more than its share
START_DEG, START_M = 5.0, 0.1  # that the mounts are off what is told of them
LATE_NS = 13 * 10**6  # each sensor after the one before it, where they drive
BASE = 'base_link'
SENSOR = Lidar(azimuth_steps=900, lowest_deg=-25.0, highest_deg=15.0)


@dataclass(frozen=True, eq=False)
class Mounted:
    """A LiDAR on a rig.

    Attributes:
        T_rig_sensor: (4, 4), x forward, y left, z up.
        lidar: `Lidar`.
        view_deg: how much of the horizon it sees, half of it to either side of its x axis [deg].
    """

    T_rig_sensor: np.ndarray
    lidar: Lidar = SENSOR
    view_deg: float = FULL_DEG


def ring_of_lidars(count, view_deg, rng):
    """Return `Mounted` LiDARs that look outwards all around, each over `view_deg` of the horizon.

    Args:
        count: how many.
        view_deg: what each sees; of 360/count neighbours see nothing in common.
        rng: np.random.Generator, of the places, and of tilts by some 8 deg.
    """
    return [
        _mounted(2 * np.pi * k / count, rng.normal(0.0, TILT_DEG, 2), view_deg, rng)
        for k in range(count)
    ]


def _mounted(azimuth, tilt_deg, view_deg, rng):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler('ZYX', [azimuth, *np.radians(tilt_deg)]).as_matrix()
    outwards = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    T[:3, 3] = SPREAD_M * (outwards + 0.3 * rng.normal(size=3))
    return Mounted(T, view_deg=view_deg)


def seen_by(mounted, points):
    """Return which of (N, 3) points in the sensor's frame lie within its view, (N,)."""
    azimuth = np.degrees(np.arctan2(points[:, 1], points[:, 0]))
    return np.abs(azimuth) <= mounted.view_deg / 2


def rig_scan(scene, T_world_rig, rig, rng):
    """Return the points (N, 3) that each LiDAR of a rig sees, in its own frame [m]."""
    clouds = []
    for mounted in rig:
        points = scan(scene, T_world_rig @ mounted.T_rig_sensor, mounted.lidar, rng)
        clouds.append(points[seen_by(mounted, points)])
    return clouds


def extrinsics_of(rig):
    """Return (S, 4, 4): each sensor in the frame of the first."""
    first = inverse(rig[0].T_rig_sensor)
    return np.array([first @ mounted.T_rig_sensor for mounted in rig])


def rig_messages(scene, count, motion, scans, rng, view_deg=None):
    """Yield (topic, log time [ns], message) of a rig of LiDARs that is driven along a route.

    Clouds on /lidar_0/points and so on; on /tf_static where each is mounted, 5 deg and 0.1 m off;
    on /ground_truth where each truly is in the frame of the first.

    Args:
        scene: Scene with a route.
        count: how many LiDARs.
        motion: `Motion`, by which each point has its time, and a sensor begins its sweep 13 ms
            after the one before it; None: all see from one pose, at once.
        scans: how many instants.
        rng: np.random.Generator.
        view_deg: what each sees of the horizon; None: 1.9 times its share.
    """
    rig = ring_of_lidars(count, view_deg or min(SHARED * FULL_DEG / count, FULL_DEG), rng)
    yield '/tf_static', START, tf_message(_told(rig, rng))
    for k, pose in enumerate(extrinsics_of(rig)[1:], start=1):
        message = transform_message(pose, START, _frame(0), _frame(k), POSE_DECIMALS)
        yield '/ground_truth', START + k, message
    if motion is None:
        poses = drive(scene, scans, rng)
        yield from _stopping(scene, rig, poses, rng)
    else:
        yield from _driving(scene, rig, motion, scans, rng)


def _stopping(scene, rig, poses, rng):
    for i, pose in enumerate(poses):
        stamp = START + (i + 1) * STEP
        for k, points in enumerate(rig_scan(scene, pose, rig, rng)):
            yield _topic(k), stamp + k, cloud_message(rounded(points), stamp, _frame(k))


def _driving(scene, rig, motion, scans, rng):
    poses, twists = moving_drive(scene, scans, rng, *motion)
    takes = round(1e9 * motion.sweep_s)
    for i, (pose, twist) in enumerate(zip(poses, twists, strict=False)):
        for k, mounted in enumerate(rig):
            late = k * LATE_NS
            stamp = START + takes * (i + 1) + late
            at = pose @ exp(late / 1e9 * twist[ROS_ORDER]) @ mounted.T_rig_sensor
            own = (adjoint(inverse(mounted.T_rig_sensor)) @ twist[ROS_ORDER])[ROS_ORDER]
            points, times = moving_scan(scene, at, own, motion.sweep_s, mounted.lidar, rng)
            kept = seen_by(mounted, points)
            columns = {'time': times[kept].astype(np.float32)}
            yield (
                _topic(k),
                stamp,
                cloud_message(rounded(points[kept]), stamp, _frame(k), columns=columns),
            )


def _told(rig, rng):
    for k, mounted in enumerate(rig):
        about = perturbed(mounted.T_rig_sensor, START_DEG, START_M, rng)
        pose = about if k else mounted.T_rig_sensor
        yield transform_message(pose, START, BASE, _frame(k), POSE_DECIMALS)


def _topic(k):
    return f'/lidar_{k}/points'


def _frame(k):
    return f'lidar_{k}'
