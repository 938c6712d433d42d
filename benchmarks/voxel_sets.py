"""Sets of pairs of one kind each, and the fixed voxel sizes that each could be registered at."""

import json
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from benchmarks.case import Case
from benchmarks.lidar_cases import scan_to_map, scan_to_scan
from benchmarks.real_pairs import CENTIMETRE, SHARED
from idem_ros.core import RegistrationConfig, register
from idem_ros.core.geometry.se3 import inverse
from idem_ros.files.cloud_file import read_cloud
from idem_ros.simulation.lidar import Lidar

OBJECT = (None, 0.0005, 0.001, 0.002, 0.004)  # [m]; None: points as given
OUTDOORS = (None, 0.125, 0.25, 0.5, 1.0)
INDOORS = (0.0625, 0.125, 0.25, 0.5)
DEPTH = (0.0125, 0.025, 0.05, 0.1)
FEW_RINGS = Lidar(rings=16, lowest_deg=-15.0, highest_deg=15.0, azimuth_steps=1800)
SEED = 40  # others than the sizes were chosen on
NO_DEPTH = (0, 65535)


class VoxelSet(NamedTuple):
    """Pairs of one kind."""

    name: str
    cases: Callable  # () -> iterator of `Case`
    sizes: tuple  # fixed voxel sizes to compare with [m]
    start: tuple  # how far guesses are off the truth: ([deg], [m])
    right: tuple  # below which a result is right: ([deg], [m])
    seen: bool = False  # whether `auto` was chosen with a look at it


def voxel_sets():
    """Return every `VoxelSet`; of real ones those that lie beside the checkout."""
    object_, car = ((2.0, 0.002), (1.0, 0.001)), ((1.5, 0.3), (0.3, 0.1))
    depth, room = ((2.0, 0.05), (2.5, 0.1)), ((1.5, 0.1), (0.3, 0.05))
    exact, coarse = (0.0, 0.0), (0.31, 0.05)
    found = [
        _real('stanford_bunny/data', OBJECT, object_, (0.1, 0.16e-3), seen=True),
        _real('stanford_dragon', OBJECT, object_, (0.15, 0.4e-3), every=2),
        _real('simpleicp', OBJECT, object_, (0.001, 1e-6), seen=True, unit=CENTIMETRE),
        _real('kitti_odometry_07', OUTDOORS, car, (0.03, 0.02), seen=True),
        _real('kitti_odometry_00', OUTDOORS, car, (0.03, 0.02), seen=True, every=2),
        _real('small_gicp', OUTDOORS, ((1.5, 0.3), (0.5, 0.1)), (0.2, 0.01), seen=True),
        _real('libpointmatcher_car', OUTDOORS, ((1.5, 0.3), (1.0, 0.2)), coarse, seen=True),
        VoxelSet('newer_06', _newer_06, OUTDOORS, (1.5, 0.1), (1.0, 0.1)),
        _real('3dmatch_redkitchen', DEPTH, depth, (1.2, 0.035), seen=True),
        VoxelSet('seven_scenes_depth', _seven_scenes, DEPTH, *depth, seen=True),
        _real('cross_source/threechair', DEPTH, depth, (0.23, 0.003), seen=True),
    ]
    found = [each for each in found if (SHARED / each.name).is_dir()]
    for kind, sizes, asked in (
        ('street', OUTDOORS, car),
        ('room', INDOORS, room),
        ('forest', OUTDOORS, car),
    ):
        found.append(VoxelSet(f'{kind}, 32 rings', _simulated(kind, exact), sizes, *asked))
        few = _simulated(kind, exact, lidar=FEW_RINGS)
        found.append(VoxelSet(f'{kind}, 16 rings', few, sizes, *asked))
    to_map = _simulated('street', exact, make=scan_to_map)
    found.append(VoxelSet('street, scan to map', to_map, OUTDOORS, *car))
    return found


def _real(item, sizes, asked, truth, seen=False, every=1, unit=1.0):
    """Return the set of an item of the truth file; truth: how far it may be off ([deg], [m])."""

    def cases():
        """Yield the `Case` of every n-th pair whose files can be read."""
        pairs = [pair for pair in _truths() if pair['item'] == item]
        for pair in pairs[::every]:
            if pair['target'].endswith('.vtk'):
                continue
            target, source = (
                unit * read_cloud(SHARED / item / pair[role]) for role in ('target', 'source')
            )
            T = np.array(pair['T_target_source'])
            T[:3, 3] *= unit
            yield Case(f'{item} {pair["source"]}', target, source, T, None, *truth)

    return VoxelSet(item, cases, sizes, *asked, seen)


@lru_cache(1)
def _truths():
    return json.loads((SHARED / 'GROUND_TRUTH.json').read_text())['pairs']


def _simulated(kind, truth, make=scan_to_scan, lidar=None):
    def cases():
        """Yield scans in scenes of their own."""
        for seed in range(SEED, SEED + (3 if make is scan_to_map else 6)):
            yield make(f'{kind} {seed}', kind, seed, None, lidar)

    return cases


def _seven_scenes():
    """Yield frames of a depth camera a third of a second apart; poses by KinectFusion."""
    folder = SHARED / 'seven_scenes_depth'
    for frame in (30, 110, 170, 250):
        (target, T_target), (source, T_source) = (
            _depth_frame(folder, number) for number in (frame, frame + 10)
        )
        truth = inverse(T_target) @ T_source
        yield Case(f'frame {frame}', target, source, truth, None, 0.4, 0.01)


def _depth_frame(folder, number):
    from PIL import Image  # comes with the pictures of the reports

    intrinsics = np.loadtxt(folder / 'camera-intrinsics.txt')
    name = f'frame-{number:06d}'
    depth = np.asarray(Image.open(folder / f'{name}.depth.png'))
    row, column = np.nonzero(~np.isin(depth, NO_DEPTH))
    z = 1e-3 * depth[row, column]
    rays = np.linalg.solve(intrinsics, [column, row, np.ones(len(z))])
    pose = np.loadtxt(folder / f'{name}.pose.txt')
    return (rays * z).T, pose


def _newer_06():
    """Yield sweeps whose motion was undone; the reference is our own: to 0.1 deg and 15 mm."""
    sweeps = [
        np.fromfile(SHARED / f'newer_06/deskewed_0{k}.bin', np.float32).reshape(-1, 3)
        for k in range(3)
    ]
    for k, other in ((0, 1), (1, 2), (0, 2)):
        target, source = (sweeps[i].astype(float) for i in (k, other))
        found = register(target, source, config=RegistrationConfig(voxel_size=0.25))
        yield Case(f'{k}-{other}', target, source, found.T_target_source, None, 0.1, 0.015)
