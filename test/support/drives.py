"""A sensor that goes twice around in a body, with an odometry that drifts."""

import numpy as np
from clouds import motion, surface

from idem_ros.core.geometry import se3
from idem_ros.files.pose_file import write_tum
from idem_ros.recording.messages import cloud_message
from idem_ros.recording.writer import write_mcap

START, STEP = 10**9, 10**8
AROUND = 8  # scans of a round


def drive(rng, count=2 * AROUND, points=500, off=(0.4, 0.01)):
    """Return clouds in their own frames, the true poses, and those of the odometry."""
    truth = []
    for k in range(count):
        angle = 2 * np.pi * k / AROUND
        pose = se3.exp(np.array([0.0, 0.0, angle / 8, 0.0, 0.0, 0.0]))
        pose[:3, 3] = 0.5 * np.cos(angle), 0.5 * np.sin(angle), 0.02 * k
        truth.append(pose)
    odometry = [truth[0]]
    for before, after in zip(truth[:-1], truth[1:], strict=True):
        step = se3.inverse(before) @ after
        odometry.append(odometry[-1] @ step @ motion(rng, *off))
    clouds = [se3.transform_points(se3.inverse(T), surface(rng, points, 0.003)) for T in truth]
    return clouds, np.array(truth), np.array(odometry)


def stamps_of(count):
    return [START + k * STEP for k in range(count)]


def write_drive(folder, clouds, odometry):
    """Write drive.mcap and drive.tum."""
    stamps = stamps_of(len(clouds))
    messages = zip(stamps, clouds, strict=True)
    write_mcap(
        folder / 'drive.mcap',
        (('/scan', stamp, cloud_message(points, stamp, 'lidar')) for stamp, points in messages),
    )
    write_tum(folder / 'drive.tum', stamps, odometry)
