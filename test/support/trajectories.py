"""Random trajectories that several tests use."""

import numpy as np
from clouds import motion

from idem_ros.files.pose_file import tum_line
from idem_ros.files.trajectory_file import CSV_HEADER, Trajectory

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


def write_kitti(path, transforms):
    """Write (4, 4) transforms as KITTI lines: twelve numbers, row by row, every digit kept."""
    np.savetxt(path, np.reshape([T[:3] for T in transforms], (-1, 12)))


def write_csv(path, stamps, transforms):
    """Write (4, 4) transforms as a table with a header line; stamps in nanoseconds."""
    lines = (tum_line(*row).replace(' ', ',') for row in zip(stamps, transforms, strict=True))
    path.write_text(CSV_HEADER + '\n' + ''.join(lines))
