"""Simulated LiDAR scans with exact truth: scan to scan, and scan to a map of earlier scans."""

from importlib import import_module

import numpy as np

from benchmarks.case import Case
from idem_ros.core.geometry import se3
from idem_ros.simulation.drive import drive
from idem_ros.simulation.lidar import Lidar, scan

STOPS = 41  # along the route
MAPPED = (-6, -4, -2, 2, 4, 6)  # stops around the scan whose scans make its map


def scan_to_scan(name, kind, seed, voxel_size, lidar=None):
    """Return the `Case` of two successive scans in a scene of its own."""
    rng, scene, poses, here = _journey(kind, seed)
    lidar = Lidar() if lidar is None else lidar
    target, source = (scan(scene, poses[stop], lidar, rng) for stop in (here, here + 1))
    truth = se3.inverse(poses[here]) @ poses[here + 1]
    return Case(name, target, source, truth, voxel_size)


def scan_to_map(name, kind, seed, voxel_size, lidar=None):
    """Return the `Case` of a scan and the scans around it, joined where they truly are.

    The map's frame is that of the first of them.
    """
    rng, scene, poses, here = _journey(kind, seed)
    lidar = Lidar() if lidar is None else lidar
    T_map_world = se3.inverse(poses[here + MAPPED[0]])
    seen = [
        (T_map_world @ poses[here + k], scan(scene, poses[here + k], lidar, rng)) for k in MAPPED
    ]
    target = np.concatenate([se3.transform_points(T, points) for T, points in seen])
    source = scan(scene, poses[here], lidar, rng)
    return Case(name, target, source, T_map_world @ poses[here], voxel_size)


def _journey(kind, seed):
    rng = np.random.default_rng([seed, *kind.encode()])
    scene = getattr(import_module(f'idem_ros.simulation.{kind}'), kind)(rng)
    poses = drive(scene, STOPS, rng)
    return rng, scene, poses, int(rng.integers(-MAPPED[0], STOPS - MAPPED[-1]))
