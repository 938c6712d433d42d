"""Two captures of one car's three LiDARs; they lie beside the project, and are not part of it."""

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.goal import Goal
from benchmarks.real_pairs import SHARED
from idem_ros.calibration.fusion import difference
from idem_ros.calibration.rig_calibration import Instant, calibrate
from idem_ros.core import Cloud
from idem_ros.core.geometry import se3
from idem_ros.files.cloud_file import read_cloud
from idem_ros.terminal.markdown import number, table

FOLDER = SHARED / 'opencalib_rig'
CAPTURES, NAMES = ('0001', '0002'), ('top', 'left', 'right')
REPEAT_M, REPEAT_DEG, SIGMAS, NEES = 0.02, 0.15, 3.0, 1.5


def capture_goals(config):
    """Return the `Goal`s of what two captures say of the same rig, and how far they are apart.

    Without its clouds there are none.
    """
    if not FOLDER.is_dir():
        return [], ''
    found = [calibrate([_instant(name)], captures_starts(name), config) for name in CAPTURES]
    goals, squares, rows = [], [], []
    for s, name in enumerate(NAMES[1:], start=1):
        first, second = (each.sensors[s] for each in found)
        off = difference(second.pose, first.pose)
        covariance = first.covariance + second.covariance
        squares.append(float(off @ np.linalg.solve(covariance, off)) / 6)
        distance, degrees = np.linalg.norm(off[:3]), np.degrees(np.linalg.norm(off[3:]))
        sigmas = max(_sigmas(off[part], covariance[part, part]) for part in _PARTS)
        near = float(max(distance / REPEAT_M, degrees / REPEAT_DEG))
        figure = f'{name}: captures apart, over what they may be'
        goals.append(Goal(figure, min(near, sigmas / SIGMAS), 1.0))
        said = ' and '.join(each.sensors[s].verdict.verdict.value for each in found)
        rows.append([name, number(1e3 * distance), number(degrees), number(sigmas), said])
    goals.append(Goal('NEES between captures', float(np.mean(squares)), NEES))
    heads = 'sensor', 'apart [mm]', '[deg]', 'in promised sigma', 'verdicts'
    return goals, table(heads, rows, left=1)


_PARTS = slice(0, 3), slice(3, 6)


def _sigmas(off, covariance):
    """Return how many standard deviations a vector is long, along itself."""
    direction = off / np.linalg.norm(off)
    return float(np.linalg.norm(off) / np.sqrt(direction @ covariance @ direction))


def _instant(name):
    clouds = tuple(Cloud(read_cloud(FOLDER / name / f'{each}.pcd')) for each in NAMES)
    return Instant(name, clouds)


def captures_starts(name):
    """Return the nominal poses of a capture: roll, pitch, yaw [deg] and x y z."""
    lines = (FOLDER / name / 'initial_extrinsic.txt').read_text().splitlines()
    rows = [line.partition(':')[2].split() for line in lines if line.startswith('(Roll')]
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    for pose, row in zip(poses, rows, strict=True):
        roll, pitch, yaw, *xyz = map(float, row)
        pose[:3, :3] = Rotation.from_euler('xyz', (roll, pitch, yaw), degrees=True).as_matrix()
        pose[:3, 3] = xyz
    return se3.inverse(poses[0]) @ poses
