"""Folders of scans with the sensor's poses: KITTI odometry, or numbered files and a trajectory."""

import logging
import re
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.exceptions import IdemError
from idem_ros.core.geometry.se3 import checked_transform
from idem_ros.files.cloud_file import KINDS, READERS
from idem_ros.files.trajectory_file import read_trajectory

START = 10**9  # [ns]; a stamp of 0 would mean "timeless"
STEP = 10**8  # [ns] between scans
TABLES = ('.txt', '.csv')  # beside the scans these may hold anything
NUMBER = re.compile(r'\d+(\.\d+)?$', re.ASCII)

logger = logging.getLogger(__name__)


class UnreadableScans(IdemError):
    """A folder that holds no scans with poses."""


@dataclass(frozen=True)
class ScanFolder:
    """Scans in the order of their numbers; none of them is read yet."""

    scans: tuple[Path, ...]
    stamps: tuple[int, ...]
    """Of each scan [ns], increasing."""
    poses: NDArray
    """(N, 4, 4), of the sensor in a fixed frame."""
    are_stamped: bool = True
    """Whether the stamps are those of a file, and not made up."""


def read_scan_folder(folder, trajectory=None):
    """Find the scans of a folder and the pose of each.

    Args:
        folder: with a trajectory: of numbered cloud files, whose names end in their number.
            Without: a KITTI odometry sequence, with `velodyne/*.bin`, `calib.txt` and
            `poses.txt`, or `../../poses/07.txt` for `sequences/07`.
        trajectory: file of the sensor's poses, one for each scan, as `read_trajectory` takes
            it; its stamps become those of the scans.

    Returns:
        `ScanFolder` of at least two scans; without stamps these are 0.1 s apart.

    Raises:
        UnreadableScans: a part is missing, a file has no number, or the numbers of scans and
            poses differ.
        UnreadableTrajectory: a line that is no pose.
    """
    folder = Path(folder)
    if trajectory is None:
        return _kitti(folder)
    scans = _numbered(folder, tuple(READERS), Path(trajectory))
    poses = read_trajectory(trajectory)
    return _matched(scans, poses.poses, poses.stamps, f'poses in {trajectory}')


def _kitti(folder):
    if not (folder / 'velodyne').is_dir():
        raise UnreadableScans(
            f'{folder} has no folder velodyne, so it is no KITTI odometry sequence; for a folder '
            'of numbered clouds, name the file of their poses with --trajectory'
        )
    scans = _numbered(folder / 'velodyne', ('.bin',))
    path = folder / 'poses.txt'
    if not path.is_file():
        path = folder.absolute().parent.parent / 'poses' / f'{folder.absolute().name}.txt'
    if not path.is_file():
        raise UnreadableScans(
            f'{folder} has no poses: neither {folder / "poses.txt"} nor {path} exists'
        )
    poses = read_trajectory(path)
    # KITTI's poses are those of the left camera; Tr brings points from the LiDAR to it
    return _matched(
        scans, poses.poses @ _lidar_in_camera(folder), poses.stamps, f'poses in {path}'
    )


def _lidar_in_camera(folder):
    path = folder / 'calib.txt'
    if not path.is_file():
        raise UnreadableScans(f'{folder} has no calib.txt; its line "Tr:" is where the LiDAR is')
    lines = [line.split() for line in path.read_text(errors='replace').splitlines()]
    rows = [words[1:] for words in lines if words and words[0] == 'Tr:']
    try:
        [numbers] = rows
        matrix = np.vstack([np.reshape([float(n) for n in numbers], (3, 4)), (0, 0, 0, 1)])
        return checked_transform(matrix, 'Tr')
    except (ValueError, IdemError) as error:
        raise UnreadableScans(
            f'{path} must hold one line "Tr:" with the twelve numbers of a rigid transform: '
            f'{error}'
        ) from error


def _numbered(folder, suffixes, trajectory=None):
    """Return the clouds of a folder in the order of their numbers."""
    if not folder.is_dir():
        raise UnreadableScans(f'{folder} is no folder of scans')
    files, skipped = {}, []
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() not in suffixes or path.name.startswith('.') or path.is_dir():
            continue
        if trajectory is not None and trajectory.exists() and path.samefile(trajectory):
            continue
        number = NUMBER.search(path.stem.removesuffix('.pcd'))
        if number is None and path.suffix.lower() in TABLES:
            skipped.append(path.name)
            continue
        if number is None:
            raise UnreadableScans(
                f'{path} is not numbered; the name of each scan must end in its number, as in '
                f'000012{path.suffix}'
            )
        other = files.setdefault(Decimal(number[0]), path)
        if other != path:
            raise UnreadableScans(f'{other} and {path} have the same number; which is it?')
    if skipped:
        logger.warning('%s: not numbered, so no scans: %s', folder, ', '.join(skipped))
    if not files:
        kinds = KINDS if len(suffixes) > 1 else suffixes[0]
        raise UnreadableScans(f'{folder} holds no cloud; its files must be numbered: {kinds}')
    return tuple(files[number] for number in sorted(files))


def _matched(scans, poses, stamps, what):
    if len(scans) != len(poses):
        raise UnreadableScans(
            f'{scans[0].parent} holds {len(scans)} scans, but there are {len(poses)} {what}; '
            'there must be one for each'
        )
    if len(scans) < 2:
        raise UnreadableScans(f'{scans[0].parent} holds one scan; a pair takes two')
    are_stamped = stamps is not None
    if stamps is None:
        stamps = START + STEP * np.arange(len(scans))
    return ScanFolder(scans, tuple(int(stamp) for stamp in stamps), poses, are_stamped)
