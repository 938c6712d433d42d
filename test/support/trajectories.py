"""Random trajectories that several tests use."""

import numpy as np
from clouds import motion

from idem_ros.files.trajectory_file import Trajectory

START = 1_700_000_000 * 10**9


def drive(rng, count=200, step=0.3, noise=(0.5, 0.02), shake=2_000_000):
    """A winding path and an estimate of it that drifts, about 0.1 s a pose."""
    reference, estimate = [np.eye(4)], [motion(rng, 20.0, 5.0)]
    for _ in range(count - 1):
        forward = motion(rng, 3.0, 0.1 * step)
        forward[0, 3] += step
        reference.append(reference[-1] @ forward)
        estimate.append(estimate[-1] @ forward @ motion(rng, *noise))
    stamps = START + np.arange(count) * 10**8
    shaken = stamps + rng.integers(-shake, shake + 1, size=count)
    return Trajectory(np.array(reference), stamps), Trajectory(np.array(estimate), shaken)
