"""The scans of a recording, read once: poses of all, the points of keyframes on disk."""

from array import array
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from idem_ros.core import IdemError
from idem_ros.core.geometry.se3 import inverse, rotation_angle
from idem_ros.files.atomic_file import UnwritableFile
from idem_ros.messages.building import CLOUD
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.recording.topics import find_topic
from idem_ros.refinement.prepared_cloud import prepared
from idem_ros.refinement.times_said import TimesSaid
from idem_ros.refinement.undoing import undoing_of

SHARE_OF_RANGE = 0.1  # of the median range, from one keyframe to the next
REASONS_KEPT = 3


class KeyframeClouds:
    """The points of keyframes in a folder, each a file, which workers read by its path.

    Args:
        folder: `Path`.
    """

    def __init__(self, folder):
        self.folder = Path(folder)

    def write(self, number, points):
        """Write the (N, 3) points of a keyframe; in float32 where that is what they came in.

        Raises:
            UnwritableFile: the disk is full.
        """
        small = points.astype(np.float32)
        kept = small if (small == points).all() else points
        try:
            np.save(self._path(number), kept)
        except OSError as error:
            raise UnwritableFile(
                f'cannot write keyframes to {self.folder}: {error.strerror or error}'
            ) from error

    def read(self, number):
        """Return the (N, 3) float64 points of a keyframe."""
        return np.load(self._path(number)).astype(np.float64)

    def _path(self, number):
        return self.folder / f'{number:07d}.npy'


@dataclass
class Scans:
    """What was read of a recording; of each scan some bytes."""

    stamps: array = field(default_factory=lambda: array('q'))
    """Of the scans that the trajectory has a pose for [ns]."""
    rows: array = field(default_factory=lambda: array('d'))
    """The first three of each pose, by the trajectory."""
    keyframes: array = field(default_factory=lambda: array('q'))
    """Which of them are keyframes."""
    uncovered: int = 0
    """Scans that the trajectory has no pose for."""
    first_uncovered: int | None = None
    """The stamp of the first of them [ns]."""
    refused: int = 0
    """Scans that cannot be used."""
    reasons: list = field(default_factory=list)
    """Of the first few of them."""
    median_range: float = 0.0
    """Of the points of the first keyframe [m]."""
    topic: str = ''
    notes: tuple = ()

    @property
    def poses(self):
        """The (S, 4, 4) poses of the scans, by the trajectory."""
        poses = np.tile(np.eye(4), (len(self.stamps), 1, 1))
        poses[:, :3] = np.array(self.rows).reshape(-1, 3, 4)
        return poses

    def add(self, stamp, pose):
        """Take a scan, and its (4, 4) pose."""
        self.stamps.append(stamp)
        self.rows.frombytes(pose[:3].tobytes())

    def refuse(self, stamp, why):
        """Count a scan that cannot be used."""
        self.refused += 1
        if len(self.reasons) < REASONS_KEPT:
            self.reasons.append(f'{stamp / 1e9:.3f} s: {why}')


class Reader:
    """Takes one scan after the other.

    Args:
        odometry: `Odometry`.
        clouds: `KeyframeClouds`.
        settings: `Settings` of a replay: what of points takes part, and whether motion is undone.
        config: `SmoothingConfig`.
    """

    def __init__(self, odometry, clouds, settings, config):
        self._odometry, self._clouds, self._settings = odometry, clouds, settings
        self._config, self._said = config, TimesSaid()
        self._last = None  # stamp of the scan before
        self._T_key = None  # pose of the last keyframe
        self.scans = Scans()

    def take(self, message):
        """Note where a scan was; keep its points where it is a keyframe."""
        stamp, scans = stamp_ns(message), self.scans
        if self._last is not None and stamp <= self._last:
            scans.refuse(stamp, 'its stamp is not later than that of the scan before it')
            return
        self._last = stamp
        pose = self._odometry.at(stamp)
        if pose is None:
            scans.uncovered += 1
            scans.first_uncovered = scans.first_uncovered or stamp
            return
        if self._is_keyframe(pose):
            try:
                self._keep(message, stamp, pose)
            except IdemError as error:
                scans.refuse(stamp, str(error))
                return
        scans.add(stamp, pose)

    def notes(self):
        """Return what a reader should know of the points' times."""
        return tuple(self._said.notes_for(self._settings.config.motion))

    def _is_keyframe(self, pose):
        if self._T_key is None:
            return True
        distance = self._config.keyframe_distance or SHARE_OF_RANGE * self.scans.median_range
        step = inverse(self._T_key) @ pose
        turn = np.degrees(rotation_angle(step))
        return np.linalg.norm(step[:3, 3]) >= distance or turn >= self._config.keyframe_turn

    def _keep(self, message, stamp, pose):
        settings = self._settings
        read = prepared('scan', message, settings.preprocessing, settings.point_times)
        self._said.news(source=read.read.times)
        undoing = undoing_of(
            read.cloud, pose, settings.config, lambda *_: self._odometry.track(stamp)
        )
        points = undoing.source.points + undoing.source.origin
        self._clouds.write(len(self.scans.keyframes), points)
        if self._T_key is None:
            self.scans.median_range = float(np.median(np.linalg.norm(points, axis=1)))
        self.scans.keyframes.append(len(self.scans.stamps))
        self._T_key = pose


def read_scans(recording, odometry, clouds, settings, config, topic=None, progress=iter):
    """Read a recording once; return its `Scans`.

    Args:
        recording: an open `Recording`.
        odometry, clouds, settings, config: see `Reader`.
        topic: of the scans; None: found by type.
        progress: wraps the iteration over `total` messages.

    Raises:
        TopicNotFound: there is nothing to read.
    """
    name = find_topic(recording, CLOUD, 'source', topic)
    reader = Reader(odometry, clouds, settings, config)
    for _, _, message in progress(recording.messages([name]), recording.topics[name].count):
        reader.take(message)
    reader.scans.topic, reader.scans.notes = name, (*reader.notes(), *recording.warnings)
    return reader.scans
