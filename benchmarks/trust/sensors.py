"""What sees the places: LiDARs of several patterns, and a depth camera with its noise."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from benchmarks.case import Case
from benchmarks.trust.places import PLACES
from idem_ros.core.geometry import se3
from idem_ros.simulation.drive import drive
from idem_ros.simulation.lidar import Lidar, scan
from idem_ros.simulation.raycast import cast
from idem_ros.simulation.room import room
from idem_ros.simulation.street import street
from idem_ros.simulation.surfaces import merged, placed

LIDAR = Lidar(azimuth_steps=600)
PATTERNS = {
    '16 rings': replace(LIDAR, rings=16, lowest_deg=-15.0),
    '32 rings': replace(LIDAR, rings=32),
    '64 rings': replace(LIDAR, rings=64, lowest_deg=-24.8, highest_deg=2.0),
    '128 rings': replace(LIDAR, rings=128, lowest_deg=-22.5, highest_deg=22.5),
    'solid-state': (60.0, 12.5),
    'random': (180.0, 25.0),
}
"""A spinning `Lidar`, or how far rays at random reach to either side and up and down [deg]."""
RAYS = 24_000  # at random
JITTER_DEG = (0.0, 0.5, 2.0)  # of roll and pitch, from scan to scan
VOXEL_SIZES = (0.5, 0.25)  # [m]
HEIGHT = 1.8  # [m]
MOTION = (0.2, 2.0)  # [m], between the two scans
HORIZON = {'motorway': (-7.5, 7.5)}  # where across the sensor is, if not in the middle [m]

IMAGE, FOCAL = (240, 320), 290.0  # of the depth camera [pixels]
DEPTHS = (0.5, 5.5)  # [m]
PER_SQUARE = (0.4e-3, 0.9e-3)  # [1/m]: noise in depth over its square, as of stereo
BEND = (0.2, 0.6)  # of it: how much of that is a bend over many pixels
DISPARITY = 44.0  # [pixel m]: focal length times base; eighths of a pixel are told apart


def place_case(kind, seed, around=None):
    """Return the `Case` of two scans in one of `PLACES` or a street, patterns in turn.

    around: of a generator, the `Scene` of what moves along, as it stands to the sensor, x ahead.
    """
    rng = np.random.default_rng([seed, *kind.encode()])
    pattern = list(PATTERNS)[seed % len(PATTERNS)]
    turn = seed // len(PATTERNS)  # each pattern at each jitter
    voxel_size = VOXEL_SIZES[(seed + turn) % len(VOXEL_SIZES)]
    jitter = np.radians(JITTER_DEG[turn % len(JITTER_DEG)])
    if kind == 'street':
        scene = street(rng)
        here = drive(scene, 41, rng)[rng.integers(6, 34)]
    else:
        scene = PLACES[kind](rng)
        across = rng.choice(HORIZON.get(kind, (0.0,))) + rng.uniform(-0.7, 0.7)
        yaw = rng.choice([0.0, np.pi]) + rng.normal(0.0, 0.05)
        above = HEIGHT + (0.5 if kind == 'field' else 0.0)
        at = rng.uniform(-8.0, 8.0), across, above
        here = _pose(at, (yaw, *jitter * rng.normal(size=2)))
    step = rng.uniform(*MOTION), rng.normal(0.0, 0.05), rng.normal(0.0, 0.02)
    truth = _pose(step, (rng.normal(0.0, 0.03), *jitter * rng.normal(size=2)))
    poses, scenes = (here, here @ truth), (scene, scene)
    if around is not None:
        along = around(rng)
        scenes = tuple(merged([scene, _carried(along, here, T)]) for T in poses)
    target, source = (
        seen(each, T, PATTERNS[pattern], rng) for each, T in zip(scenes, poses, strict=True)
    )
    name = f'{kind} {pattern} {voxel_size} {seed}'
    return Case(name, target, source, truth, voxel_size)


def _carried(along, here, T):
    """Return a `Scene` that heads as the sensor does at one pose, at another; on the ground."""
    yaw = np.arctan2(here[1, 0], here[0, 0])
    return placed(along, T[0, 3], T[1, 3], T[2, 3] - HEIGHT, yaw)


def seen(scene, T, pattern, rng):
    """Return the (N, 3) points that a pattern sees of a scene from a pose."""
    if isinstance(pattern, Lidar):
        return scan(scene, T, pattern, rng)
    aside, up = np.radians(rng.uniform(-1.0, 1.0, (2, RAYS)) * np.reshape(pattern, (2, 1)))
    rays = np.column_stack([np.cos(up) * np.cos(aside), np.cos(up) * np.sin(aside), np.sin(up)])
    ranges = cast(scene, T[:3, 3], se3.rotate(T[:3, :3], rays), LIDAR.max_range_m)
    kept = np.isfinite(ranges) & (ranges > LIDAR.min_range_m)
    kept &= rng.random(RAYS) > LIDAR.dropout
    return rays[kept] * (ranges + rng.normal(0.0, LIDAR.range_noise_m, RAYS))[kept, None]


def depth_case(seed, voxel_size):
    """Return the `Case` of two frames of a depth camera in a furnished room."""
    rng = np.random.default_rng([seed, *b'depth'])
    scene = room(rng)
    at = scene.route[rng.integers(len(scene.route) // 6, 5 * len(scene.route) // 6)]
    to_optical = np.eye(4)
    to_optical[:3, :3] = (0, 0, 1), (-1, 0, 0), (0, -1, 0)
    angles = rng.uniform(0.0, 2 * np.pi), rng.normal(0.1, 0.1), rng.normal(0.0, 0.05)
    here = _pose(at + (0.0, 0.0, rng.uniform(1.0, 1.6)), angles) @ to_optical
    truth = np.eye(4)
    turn = np.radians(rng.uniform(2.0, 8.0)) * _direction(rng)
    truth[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    truth[:3, 3] = rng.uniform(0.02, 0.2) * _direction(rng)
    target, source = (_depth_frame(scene, T, rng) for T in (here, here @ truth))
    return Case(f'depth {voxel_size} {seed}', target, source, truth, voxel_size)


def _depth_frame(scene, T, rng):
    """Return the (N, 3) points of a depth image: fine and smooth noise, and rounding."""
    height, width = IMAGE
    v, u = np.mgrid[:height, :width].reshape(2, -1)
    rays = np.column_stack([(u - width / 2) / FOCAL, (v - height / 2) / FOCAL, np.ones(u.shape)])
    length = np.linalg.norm(rays, axis=1)
    depth = cast(scene, T[:3, 3], se3.rotate(T[:3, :3], rays / length[:, None]), 9.0) / length
    kept = (depth > DEPTHS[0]) & (depth < DEPTHS[1]) & (rng.random(len(depth)) > 0.1)
    fine = 0.5 * rng.normal(size=len(depth)) + 0.8 * _smooth(rng, 2.5)
    noise = fine + rng.uniform(*BEND) * 0.8 * _smooth(rng, 12.0)
    depth = depth[kept]
    depth += rng.uniform(*PER_SQUARE) * depth**2 * noise[kept]
    depth = DISPARITY / (np.round(8 * DISPARITY / depth) / 8)
    return rays[kept] * depth[:, None]


def _smooth(rng, pixels):
    image = gaussian_filter(rng.normal(size=IMAGE), pixels).ravel()
    return image / image.std()


def _pose(position, yaw_pitch_roll):
    T = se3.translation(position)
    T[:3, :3] = Rotation.from_euler('ZYX', yaw_pitch_roll).as_matrix()
    return T


def _direction(rng):
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)
