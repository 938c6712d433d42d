"""Odometry of simulated fast drives, scan after scan, beside KISS-ICP with its own deskewing."""

from importlib import import_module

import numpy as np

from benchmarks.goal import Goal
from benchmarks.sweeps.cases import NOISE, SWEEP
from idem_ros.core import Cloud, register, undistort
from idem_ros.core.geometry import se3
from idem_ros.simulation.drive import moving_drive
from idem_ros.simulation.lidar import Lidar, moving_scan

DRIVES = (('street', 10.0, 30.0), ('forest', 8.0, 60.0), ('tunnel', 15.0, 30.0))
"""Scene, speed [m/s], turn rate [deg/s]."""
SCANS = 24
KEPT = 4  # scans that make the target
VOXEL = 0.5  # [m]
SETTLED = 4  # scans from the standing start of either that are not scored
MOST = 0.5  # of its translation error a scan
MIDDLE = SWEEP / 2


def measure(config, seed, progress):
    """Return {scene: (our median error of a scan's translation [m], KISS-ICP's or None)}."""
    found = {}
    for kind, speed, turn in progress(DRIVES):
        rng = np.random.default_rng([seed, *kind.encode()])
        scene = getattr(import_module(f'idem_ros.simulation.{kind}'), kind)(rng)
        poses, twists = moving_drive(scene, SCANS, rng, speed, np.radians(turn), SWEEP)
        lidar = Lidar(rings=32, azimuth_steps=900, range_noise_m=NOISE)
        scans = [
            moving_scan(scene, T, twist, SWEEP, lidar, rng)
            for T, twist in zip(poses, twists, strict=False)
        ]
        found[kind] = _ours(scans, poses, twists, config), _of_kiss(scans, poses, twists)
    return found


def goals(found):
    """Return the `Goal`s, those of drives that KISS-ICP has gone through."""
    for kind, (ours, theirs) in found.items():
        if theirs is not None:
            yield Goal(
                f"odometry, {kind}: translation error a scan, over KISS-ICP's", ours / theirs, MOST
            )


def _ours(scans, poses, twists, config):
    """Return the median error of a scan's translation, each against the scans before, undone."""
    config = config(VOXEL, 'solve')
    first = twists[0]
    path, twist, step, kept = [np.eye(4)], first, se3.exp(SWEEP * first[se3.ROS_ORDER]), []
    for points, times in scans:
        T, source = path[-1] @ step, Cloud(points, times)
        if kept:
            found = register(np.concatenate(kept[-KEPT:]), source, T, config, twist=twist)
            T, twist = found.T_target_source, found.twist
        undone = undistort(points, times, twist, 'middle')
        kept.append(se3.transform_points(T, undone))
        step = se3.exp(SWEEP * twist[se3.ROS_ORDER])
        path.append(T)
    return _error(path[1:], poses, twists, MIDDLE)


def _of_kiss(scans, poses, twists):
    """Return the same of KISS-ICP, its poses taken for those at the instant that suits it best."""
    try:
        from kiss_icp.config import load_config
        from kiss_icp.kiss_icp import KissICP
    except ImportError:
        return None
    config = load_config(None)
    config.data.max_range, config.data.min_range = 50.0, 1.0
    config.data.deskew, config.mapping.voxel_size = True, VOXEL
    kiss, path = KissICP(config), []
    kiss.last_delta = se3.exp(SWEEP * twists[0][se3.ROS_ORDER])
    for points, times in scans:
        kiss.register_frame(points, times / SWEEP)
        path.append(kiss.last_pose.copy())
    return min(_error(path, poses, twists, at) for at in (0.0, MIDDLE, SWEEP))


def _error(path, poses, twists, at):
    """Return the median error of the translations from scan to scan [m]."""
    true = [T @ se3.exp(at * w[se3.ROS_ORDER]) for T, w in zip(poses, twists, strict=False)]
    errors = []
    for k in range(SETTLED, len(path) - 1):
        moved, truly = (se3.inverse(way[k]) @ way[k + 1] for way in (path, true))
        errors.append(np.linalg.norm(moved[:3, 3] - truly[:3, 3]))
    return float(np.median(errors))
