"""A stream of large clouds as bytes that are ready to be sent: only their stamps change."""

import struct
from dataclasses import dataclass

import numpy as np

from idem_ros.core.geometry.se3 import inverse
from idem_ros.recording.cdr import to_cdr
from idem_ros.recording.messages import cloud_message, transform_message
from idem_ros.simulation.drive import drive, perturbed
from idem_ros.simulation.lidar import Lidar, scan
from idem_ros.simulation.street import street

RINGS = 64
SPARE = 1.3  # more rays than points: some hit nothing
STEP = 1.0  # [m] between two scans
GUESS_DEG, GUESS_M = 1.5, 0.3
TARGET, SOURCE = 'map', 'lidar'


@dataclass(frozen=True)
class Tick:
    """What is published at one time: two clouds and the guess between them, as CDR bytes."""

    target: bytes
    source: bytes
    initial_guess: bytes

    def stamped(self, stamp: int) -> dict[str, bytes]:
        """Return {topic: bytes}, each with a stamp [ns]."""
        return {name: stamped(cdr, stamp) for name, cdr in vars(self).items()}


def stamped(cdr: bytes, stamp: int) -> bytes:
    """Return the bytes of a message that begins with a header, with another stamp [ns]."""
    return cdr[:4] + struct.pack('<iI', *divmod(stamp, 10**9)) + cdr[12:]


def street_stream(points: int, count: int, seed: int = 0) -> list[Tick]:
    """Return scans of a drive along a street, each as the source for the one before.

    Args:
        points: of every cloud, exactly.
        count: how many ticks.
        seed: of the street.
    """
    rng = np.random.default_rng(seed)
    scene = street(rng)
    steps = int(SPARE * points / RINGS)
    lidar = Lidar(RINGS, -24.8, 2.0, steps, range_noise_m=0.02, max_range_m=120.0)
    length = np.linalg.norm(np.diff(scene.route, axis=0), axis=1).sum()
    poses = drive(scene, int(length / STEP), rng)[: count + 1]
    scans = [_exactly(points, scan(scene, pose, lidar, rng), rng) for pose in poses]
    ticks = []
    for i in range(count):
        guess = perturbed(inverse(poses[i]) @ poses[i + 1], GUESS_DEG, GUESS_M, rng)
        messages = (
            cloud_message(scans[i], 0, TARGET),
            cloud_message(scans[i + 1], 0, SOURCE),
            transform_message(guess, 0, TARGET, SOURCE),
        )
        ticks.append(Tick(*map(to_cdr, messages)))
    return ticks


def _exactly(count, points, rng):
    return points[np.sort(rng.choice(len(points), count, replace=len(points) < count))]
