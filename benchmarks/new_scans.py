"""Real scans that came after the solver: no number of it was chosen on them.

The dragon's ring, 16 scans of KITTI 00 in traffic, frames of a depth camera (7-Scenes).
"""

from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import pairwise

import numpy as np

from benchmarks.case import Case
from benchmarks.real_pairs import ROLES, SHARED, truths
from idem_ros.core.geometry import se3
from idem_ros.files.cloud_file import read_cloud

DEPTH_FRAMES_APART = (1, 3)  # of those that are there, a third of a second each
NO_DEPTH = (0, 65535)


@dataclass(frozen=True)
class ScanSet:
    """Pairs of real scans of one kind, and what is asked of a result.

    Lengths are in `unit_m` metres, as in the cases: small_gicp damps and stops in the clouds'
    own unit, and would serve an object in metres badly.

    Attributes:
        name: of the set.
        pairs: ((target, source), build) of each: the scans' names; build(voxel_size) makes the
            `Case`.
        voxel_sizes: to register at.
        starts: {name of a level: (degrees, length)} that guesses are off the truth.
        right: (degrees, length) below which a result is right.
        truth: (degrees, length) that the truth itself may be off.
        unit_m: the unit of length [m].
    """

    name: str
    pairs: tuple
    voxel_sizes: tuple
    starts: dict
    right: tuple
    truth: tuple
    unit_m: float = 1.0


def scan_sets():
    """Return the `ScanSet`s that lie beside the checkout; none where the folder is not there."""
    made = {
        'stanford_dragon': _dragon,
        'kitti_odometry_00': _kitti_00,
        'seven_scenes_depth': _seven_scenes,
    }
    return [make(SHARED / folder) for folder, make in made.items() if (SHARED / folder).is_dir()]


def _dragon(folder):
    pairs = [pair for pair in truths() if pair['item'] == folder.name]
    return ScanSet(
        'dragon',
        tuple(_from_truth(pair, folder, read_cloud, 1e3) for pair in pairs),
        voxel_sizes=(1.0, 2.0, 4.0),
        starts={'near': (1.5, 1.0), 'far': (10.0, 4.0)},
        right=(1.0, 1.5),
        truth=(0.15, 0.4),
        unit_m=1e-3,
    )


def _kitti_00(folder):
    pairs = [pair for pair in truths() if pair['item'] == folder.name]
    steps = [pair for pair in pairs if _frame(pair, 'source') == _frame(pair, 'target') + 1]
    return ScanSet(
        'KITTI 00',
        tuple(
            _from_truth(pair, folder, read_cloud)
            for pair in steps + [_joined(*two) for two in pairwise(steps)]
        ),
        voxel_sizes=(0.25, 0.5, 1.0),
        starts={'near': (1.5, 0.3), 'far': (10.0, 2.0)},
        right=(1.0, 0.25),
        truth=(0.03, 0.02),
    )


def _frame(pair, role):
    return int(pair[role].partition('.')[0])


def _joined(first, second):
    """Return the pair of the outer two of three scans."""
    T = np.array(first['T_target_source']) @ np.array(second['T_target_source'])
    return {'target': first['target'], 'source': second['source'], 'T_target_source': T}


def _seven_scenes(folder):
    frames = sorted(folder.glob('*.depth.png'))
    read = partial(_depth_image, intrinsics=np.loadtxt(folder / 'camera-intrinsics.txt'))
    poses = [np.loadtxt(str(path).replace('.depth.png', '.pose.txt')) for path in frames]
    pairs = [
        {
            **dict(zip(ROLES, (frames[i].name, frames[i + apart].name), strict=True)),
            'T_target_source': se3.inverse(_rigid(poses[i])) @ _rigid(poses[i + apart]),
        }
        for apart in DEPTH_FRAMES_APART
        for i in range(0, len(frames) - apart, apart)
    ]
    return ScanSet(
        '7-Scenes',
        tuple(_from_truth(pair, folder, read) for pair in pairs),
        voxel_sizes=(0.05, 0.1),
        starts={'near': (1.5, 0.1), 'far': (10.0, 0.3)},
        right=(1.5, 0.05),
        truth=(0.4, 0.01),
    )


def _rigid(pose):
    """Return a pose with its rotation made one again: it was rounded."""
    left, _, right = np.linalg.svd(pose[:3, :3])
    pose = pose.copy()
    pose[:3, :3] = left @ right
    return pose


def _from_truth(pair, folder, read, scale=1.0):
    """Return (names, build) of a pair; scale: from what read(path) gives to the set's unit."""
    names = tuple(pair[role] for role in ROLES)
    name = f'{folder.name} {names[0]} {names[1]}'
    return names, partial(_case, name, folder, names, pair['T_target_source'], read, scale)


def _case(name, folder, names, T, read, scale, voxel_size):
    truth = np.array(T)
    truth[:3, 3] *= scale
    target, source = (scale * _points(read, folder / each) for each in names)
    return Case(f'{name} {voxel_size}', target, source, truth, voxel_size)


@lru_cache(4)  # the same scans come again, at the next voxel size and in the next pair
def _points(read, path):
    return read(path)


def _depth_image(path, intrinsics):
    """Return the (N, 3) points [m] of a depth image in millimetres, in the camera's frame."""
    from PIL import Image

    depth = np.asarray(Image.open(path))
    row, column = np.nonzero(~np.isin(depth, NO_DEPTH))
    z = 1e-3 * depth[row, column]
    x = (column - intrinsics[0, 2]) * z / intrinsics[0, 0]
    y = (row - intrinsics[1, 2]) * z / intrinsics[1, 1]
    return np.column_stack([x, y, z])
