"""Three hard sweeps of a real handheld LiDAR, solved from no motion against the same, undone."""

import numpy as np

from benchmarks.goal import Goal
from benchmarks.real_pairs import SHARED
from idem_ros.core import Cloud, register, undistort
from idem_ros.core.geometry import se3

FOLDER = SHARED / 'newer_06'
LEAST_CM = (3.2, 1.4, 4.4)  # what one constant twist, fitted to the truth itself, leaves
MOST = 1.4  # times that
VOXEL = 0.25  # [m]
BEHIND = np.array([-1.0, -1.0, 1.0])  # raw points are turned by half a turn


def measure(config):
    """Return (before, at voxels of 0.25 m, at those found) of each sweep; () where there are none.

    Medians of the points' distances to where an IMU-aided SLAM has them [cm].
    """
    if not FOLDER.is_dir():
        return ()
    rows = []
    for k in range(len(LEAST_CM)):
        raw, truth = (_read(f'{name}_{k:02}.bin').reshape(-1, 3) for name in ('raw', 'deskewed'))
        source = Cloud(raw * BEHIND, _read(f'times_{k:02}.bin'))
        rows.append(
            (
                _apart(raw * BEHIND, truth),
                *(_left(source, raw * BEHIND, truth, config(v, 'solve')) for v in (VOXEL, 'auto')),
            )
        )
    return tuple(rows)


def goals(rows):
    """Return the `Goal`s."""
    for k, (row, least) in enumerate(zip(rows, LEAST_CM, strict=True)):
        yield Goal(
            f'newer_06, sweep {k}: points to their truth, median', row[1], MOST * least, 'cm'
        )


def _left(source, points, truth, config):
    result = register(truth, source, config=config)
    undone = undistort(points, source.times, result.twist, config.motion_reference)
    return _apart(se3.transform_points(result.T_target_source, undone), truth)


def _apart(points, truth):
    return 100 * float(np.median(np.linalg.norm(points - truth, axis=1)))


def _read(name):
    return np.fromfile(FOLDER / name, np.float32).astype(np.float64)
