"""A stream of large clouds as bytes that are ready to be sent: only their stamps change."""

import struct
from dataclasses import dataclass

import numpy as np

from idem_ros.core.geometry.se3 import inverse
from idem_ros.recording.messages import cloud_message, to_cdr, transform_message
from idem_ros.simulation.drive import drive, moving_drive, perturbed
from idem_ros.simulation.lidar import Lidar, moving_scan, scan
from idem_ros.simulation.street import street

RINGS = 64
SPARE = 1.3  # more rays than points: some hit nothing
STEP = 1.0  # [m] between two scans
GUESS_DEG, GUESS_M = 1.5, 0.3
TARGET, SOURCE = 'map', 'lidar'
SWEEP, SPEED, TURN_DEG = 0.1, 15.0, 60.0  # [s], [m/s], [deg/s] of a drive without a halt


@dataclass(frozen=True)
class Tick:
    """What is published at one time: two clouds and the guess between them, as CDR bytes."""

    target: bytes
    source: bytes
    initial_guess: bytes
    target_age: int = 0
    """How much older than the others the target is [ns]."""

    def stamped(self, stamp: int) -> dict[str, bytes]:
        """Return {topic: bytes}, each with a stamp [ns]."""
        return {
            'target': stamped(self.target, stamp - self.target_age),
            'source': stamped(self.source, stamp),
            'initial_guess': stamped(self.initial_guess, stamp),
        }


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
    scene, lidar = street(rng), _lidar(points)
    length = np.linalg.norm(np.diff(scene.route, axis=0), axis=1).sum()
    poses = drive(scene, int(length / STEP), rng)[: count + 1]
    scans = [_exactly(points, scan(scene, pose, lidar, rng), rng) for pose in poses]
    return [
        Tick(
            to_cdr(cloud_message(scans[i], 0, TARGET)),
            to_cdr(cloud_message(scans[i + 1], 0, SOURCE)),
            _guess(poses[i : i + 2], TARGET, rng),
        )
        for i in range(count)
    ]


def moving_stream(points: int, count: int, seed: int = 0) -> list[Tick]:
    """Return the same of a drive without a halt: sweeps with times, scan to scan, one frame.

    Each is stamped at its end, when it can be published.
    """
    rng = np.random.default_rng(seed)
    scene, lidar = street(rng), _lidar(points)
    poses, twists = moving_drive(scene, count + 1, rng, SPEED, np.radians(TURN_DEG), SWEEP)
    sweeps = []
    for pose, twist in zip(poses, twists, strict=False):
        seen = np.column_stack(moving_scan(scene, pose, twist, SWEEP, lidar, rng))
        some = _exactly(points, seen, rng)
        times = {'time': (some[:, 3] - SWEEP).astype(np.float32)}
        sweeps.append(to_cdr(cloud_message(some[:, :3], 0, SOURCE, columns=times)))
    age = round(1e9 * SWEEP)
    return [
        Tick(sweeps[i], sweeps[i + 1], _guess(poses[i + 1 : i + 3], SOURCE, rng), age)
        for i in range(count)
    ]


def _lidar(points):
    return Lidar(RINGS, -24.8, 2.0, int(SPARE * points / RINGS), 0.02, max_range_m=120.0)


def _guess(poses, target_frame, rng):
    """Return a guess of the second of two poses in the first as CDR bytes."""
    guess = perturbed(inverse(poses[0]) @ poses[1], GUESS_DEG, GUESS_M, rng)
    return to_cdr(transform_message(guess, 0, target_frame, SOURCE))


def _exactly(count, points, rng):
    return points[np.sort(rng.choice(len(points), count, replace=len(points) < count))]
