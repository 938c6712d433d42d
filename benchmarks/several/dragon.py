"""The Stanford dragon's ring of 15 scans; they lie beside the project, and are not part of it."""

import numpy as np

from benchmarks.case import displaced
from benchmarks.real_pairs import SHARED
from benchmarks.several.scenes import Scene
from idem_ros.files.cloud_file import read_cloud
from idem_ros.messages.transform_message import matrix_from

FOLDER = SHARED / 'stanford_dragon'
VOXEL_SIZE = 0.002  # [m]
OFF_DEG, OFF_M, SEED = 1.5, 0.002, 7  # of each start


def dragon():
    """Return the `Scene` of the ring, in its order; None where the scans are not here."""
    file = FOLDER / 'dragonStandRight.conf'
    if not file.is_file():
        return None
    rows = [line.split() for line in file.read_text().splitlines() if line.startswith('bmesh')]
    rows.sort(key=lambda row: int(row[1].rpartition('_')[2].removesuffix('.ply')))
    clouds = [read_cloud(FOLDER / row[1]) for row in rows]
    truth = np.array([_pose([float(word) for word in row[2:]]) for row in rows])
    rng = np.random.default_rng(SEED)
    starts = [
        displaced(T, cloud.mean(axis=0), OFF_DEG, OFF_M, rng)
        for T, cloud in zip(truth, clouds, strict=True)
    ]
    return Scene(clouds, truth, np.array(starts), [], VOXEL_SIZE)


def _pose(numbers):
    x, y, z, w = numbers[3:]
    return matrix_from(numbers[:3], (x, y, z, -w))  # the scans' README: the inverse rotation
