"""Simulated sweeps of a sensor in motion, beside scans of the same sensor standing still."""

from dataclasses import dataclass
from importlib import import_module

import numpy as np

from benchmarks.case import Case
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.undistortion import reference_time
from idem_ros.simulation.drive import drive, perturbed
from idem_ros.simulation.lidar import Lidar, moving_scan, scan

SCENES = {'street': 0.5, 'forest': 0.5, 'tunnel': 0.5, 'room': 0.2}
"""Scenes and the voxels whose spacing tells what is right [m]."""
SPEEDS = {'room': (1.0, 2.0, 3.0)}
FAST = (5.0, 10.0, 20.0)  # [m/s], everywhere else
TURNS = (20.0, 45.0, 90.0)  # [deg/s]
RINGS = (16, 32, 64, 128)
SWEEP = 0.1  # [s]
NOISE = 0.02  # [m]
STOPS = 41
GUESS_DEG, GUESS_M = 1.5, 0.3
ODOMETRY_ERROR = 0.05  # of each component of the twist, standard deviation


@dataclass(frozen=True, eq=False)
class Sweep:
    """One sweep in motion, and all that is known of it.

    Attributes:
        kind: the scene.
        rings: of the sensor.
        still: `Case` of a scan from the pose at the middle of the points' times, its truth.
        points: (N, 3) of the sweep, each in the sensor's frame at its own time.
        times: (N,) [s] from the sweep's begin.
        twist: (6,) the exact one.
        odometry: (6,) what an odometry says of it.
        guess: (4, 4) at the sweep's middle.
    """

    kind: str
    rings: int
    still: Case
    points: np.ndarray
    times: np.ndarray
    twist: np.ndarray
    odometry: np.ndarray
    guess: np.ndarray


def sweep(kind, seed):
    """Return the `Sweep` of a scene, a sensor and a motion by their number.

    The target is a scan from a pose before, of a sensor that stood still.
    """
    rng = np.random.default_rng([seed, *kind.encode()])
    scene = getattr(import_module(f'idem_ros.simulation.{kind}'), kind)(rng)
    poses = drive(scene, STOPS, rng)
    here = int(rng.integers(3, STOPS - 3))
    lidar = Lidar(rings=RINGS[seed % 4], azimuth_steps=900, range_noise_m=NOISE)
    speed = SPEEDS.get(kind, FAST)[seed % 3]
    turn = np.radians(TURNS[seed // 3 % 3]) * rng.choice([-1.0, 1.0])
    twist = np.array([speed, *rng.normal(0.0, 0.1, 2), *rng.normal(0.0, 0.05, 2), turn])
    begin = poses[here + 1]
    target = scan(scene, poses[here], lidar, rng)
    seen, times = moving_scan(scene, begin, twist, SWEEP, lidar, rng)
    # of the points, as `motion_reference` has it: half a column before that of the turn
    middle = reference_time(times, 'middle')
    truth = se3.inverse(poses[here]) @ begin @ se3.exp(middle * twist[se3.ROS_ORDER])
    still = scan(scene, poses[here] @ truth, lidar, rng)
    off = GUESS_M if kind != 'room' else GUESS_M / 3
    return Sweep(
        kind,
        lidar.rings,
        Case(f'{kind} {seed}', target, still, truth, SCENES[kind]),
        seen,
        times,
        twist,
        twist * (1.0 + ODOMETRY_ERROR * rng.normal(size=6)),
        perturbed(truth, GUESS_DEG, off, rng),
    )
