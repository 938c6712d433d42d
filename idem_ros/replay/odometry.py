"""Registers scans of one topic, each to the one before or to the last few."""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from idem_ros.core import Cloud
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.core.geometry.undistortion import reference_time
from idem_ros.core.metric.voxel_size import with_voxel_size
from idem_ros.pairing.turn_rates import TurnRates
from idem_ros.refinement.prepared_cloud import PreparedCloud, Stopwatch, left_out
from idem_ros.refinement.refiner import registered
from idem_ros.refinement.sweep_motion import UnknownMotion, turned
from idem_ros.refinement.times_said import TimesSaid
from idem_ros.refinement.track import Track, twist_of
from idem_ros.refinement.undoing import undoing_of, undone
from idem_ros.replay.peers import method_of
from idem_ros.replay.settings import SCAN

ODOM = 'odom'
SCANS_KEPT = 10  # of a submap


@dataclass(frozen=True)
class Scan:
    """A scan that was read."""

    stamp: int
    frame: str
    cloud: PreparedCloud
    read_ms: float
    rates: TurnRates | None = None
    """Those of an IMU around the stamp; None: none came."""


class Odometry:
    """Registers scans by `Settings`; keeps no more of them than the next one needs.

    The guess is the last motion, continued for the time that has passed. Where a registration
    finds no answer (no overlap, a degenerate scene, too few points), the guess is the pose.

    Attributes:
        times_said: `TimesSaid` of the scans so far, and of the IMU.
    """

    def __init__(self, settings):
        self.settings = settings
        self.method = method_of(settings)
        self.times_said = TimesSaid()
        self._T_odom_last = np.eye(4)
        self._middles = deque(maxlen=2)  # (instant [ns], pose in odom): of a sweep its middle
        self._usual_middle = 0.0  # of the last sweep [s after its stamp]
        self._first: Scan | None = None  # the first scan, until the second tells how it moved
        self._map = deque(maxlen=1 if settings.sequence == SCAN else SCANS_KEPT)

    def refine(self, scan):
        """Register a `Scan` to those before it.

        Returns:
            `Refinement` of its pose in `odom`; None of the first.
        """
        T_guess = self._guess(scan.stamp)
        undoing = self._undoing(scan, T_guess, self._last_track)
        if not self._map:
            self._middles.append((scan.stamp + round(1e9 * undoing.middle), T_guess))
            self._go_on(T_guess, scan.cloud.cloud)
            self._first = scan
            return None
        refinement = self._registered(scan, undoing)
        self._middles.append(self._middle(scan, undoing, refinement))
        first, is_undone = self._first, self.settings.config.motion != 'none'
        if first is not None and is_undone and refinement.result.is_usable:
            undoing = self._from_the_begin(first, scan)
            refinement = self._registered(scan, undoing)
            self._middles[-1] = self._middle(scan, undoing, refinement)
        self._first = None
        assert refinement.took_part is not None  # as of every one that was just registered
        self._go_on(refinement.result.T_target_source, refinement.took_part.source)
        return refinement

    def _from_the_begin(self, first, scan):
        """Undo the first scan by the motion to the second; return the `Undoing` of that by it."""
        track, cloud = self._last_track(), first.cloud.cloud
        if cloud.times is not None:
            places = self.settings.config.motion_reference, 'middle'
            at, middle = (reference_time(cloud.times, place) for place in places)
            sweep = float(cloud.times.min()), float(cloud.times.max())
            of_first, _ = turned(track, first.rates, first.stamp, *sweep)
            self._middles[0] = self._middles[0][0], of_first.step(at, middle)
            self._map.clear()
            self._go_on(np.eye(4), undone(cloud, of_first, at))
        last, T_last = self._middles[0]
        T_guess = T_last @ track.step(0.0, (scan.stamp - last) / 1e9)
        return self._undoing(scan, T_guess, lambda: track)

    @staticmethod
    def _middle(scan, undoing, refinement):
        middle, T_middle = undoing.to_middle(refinement.result)
        T = refinement.result.T_target_source
        return scan.stamp + round(1e9 * middle), T @ T_middle

    def _undoing(self, scan, T_guess, told):
        """Return the `Undoing` of a scan, by the `Track` that is told and its IMU."""

        def find(begin, end):
            track, said = turned(told(), scan.rates, scan.stamp, begin, end)
            self.times_said.news(imu=said)
            return track

        self.times_said.news(source=scan.cloud.read.times)
        solves = self.method.solves_motion and not self._is_smeared()
        given = self.settings.config, find, solves, self._usual_middle
        undoing = undoing_of(scan.cloud.cloud, T_guess, *given)
        self._usual_middle = undoing.middle
        return undoing

    def _is_smeared(self):
        """Whether the scan before is as it was measured: a motion fits it that makes up for its.

        Points without times cannot be undone.
        """
        return self.settings.sequence == SCAN and bool(self._map) and self._map[-1].times is None

    def _last_track(self):
        """Return the `Track` of the last motion, which goes on.

        Raises:
            UnknownMotion: there was none yet.
        """
        if len(self._middles) < 2:
            raise UnknownMotion('of two scans that tell the motion one came')
        step, duration = self._step()
        return Track.of_twist(twist_of(step, duration / 1e9))

    def _registered(self, scan, undoing):
        watch = Stopwatch()
        target, T_odom_target = self._target()
        T_guess = undoing.T_guess
        refinement = registered(
            self.method,
            target,
            replace(undoing, T_guess=inverse(T_odom_target) @ T_guess),
            stamp=scan.stamp,
            target_frame=ODOM,
            source_frame=scan.frame,
            time_ms=scan.read_ms + watch.lap(),
            points_target=len(target),
            points_source=len(scan.cloud.preprocessed.points),
            **left_out(scan.cloud),
        )
        result = refinement.result
        T = T_odom_target @ result.T_target_source if result.is_usable else T_guess
        return replace(refinement, T_guess=T_guess, result=replace(result, T_target_source=T))

    def _go_on(self, T_odom_scan, cloud):
        self._T_odom_last = T_odom_scan
        self._map.append(self._kept(cloud, T_odom_scan))

    def _kept(self, cloud, T_odom_scan):
        if self.settings.sequence == SCAN:
            return cloud
        size = with_voxel_size(self.settings.config, cloud, cloud).voxel_size
        cloud = cloud if size is None else cloud.reduced(size)
        return transform_points(T_odom_scan, cloud.points + cloud.origin)

    def _target(self):
        """Return what the next scan is registered to, and where that is in odom."""
        if self.settings.sequence == SCAN:
            return self._map[0], self._T_odom_last
        return Cloud(np.concatenate(self._map)), np.eye(4)

    def _guess(self, stamp):
        """Return where a scan of a stamp [ns] is, if the last motion goes on."""
        if len(self._middles) < 2:
            return self._T_odom_last
        (last, T_last), (step, duration) = self._middles[-1], self._step()
        return T_last @ continued(step, (stamp - last) / duration)

    def _step(self):
        (before, T_before), (last, T_last) = self._middles
        return inverse(T_before) @ T_last, last - before


def continued(step, ratio):
    """Return a (4, 4) motion that lasts `ratio` times as long, at the same speeds."""
    motion = np.eye(4)
    rotation = Rotation.from_matrix(step[:3, :3]).as_rotvec()
    motion[:3, :3] = Rotation.from_rotvec(ratio * rotation).as_matrix()
    motion[:3, 3] = ratio * step[:3, 3]
    return motion
