"""Register scans in maps of a town, beside small_gicp's GICP, and drive through one of them."""

from dataclasses import dataclass, field, replace
from time import perf_counter, sleep

import numpy as np

from benchmarks.goal import Goal
from benchmarks.maps import from_disk
from benchmarks.maps.town import Town, height, scene_around
from benchmarks.timing import interleaved_ms
from idem_ros.core import Cloud, MapCloud, Status, Verdict, register, warm_up
from idem_ros.core.geometry import se3
from idem_ros.replay.peers import CRITERIA, NEIGHBOURS, small_gicp
from idem_ros.simulation.drive import perturbed
from idem_ros.simulation.lidar import Lidar, scan

MILLIONS = 0.2, 1.0, 5.0, 14.0, 50.0
GICP_UP_TO = 14.0  # millions of points: beyond, its target alone takes gigabytes
DRIVEN = 14.0
VOXEL = 0.5  # [m]
LIDAR = Lidar(rings=64, azimuth_steps=1152, max_range_m=50.0)
SENSOR = 1.8  # [m] above the ground
START = 1.5, 0.5  # [deg], [m]: guesses are off by so much
PLACES, GUESSES = 5, 4  # of verdicts, in each map
ROUNDS = 15
SPEED, RATE, SCANS = 15.0, 10.0, 150  # [m/s], [Hz]: of the drive
AHEAD = 2.0  # [s]: how far ahead blocks are prepared
APART = 400.0  # [m]: two scans in a map from disk
RIGHT = 0.2, 0.05  # [deg], [m]
RATIO, LATEST, SHARE = 1.2, 100.0, 1.0  # times, [ms], [%] of right results that are not aligned


@dataclass
class Figures:
    """What came of the scans in one map.

    Attributes:
        millions: points of the map.
        first_s: from nothing prepared to the first result [s].
        idem_ms, gicp_ms: (rounds,) of scans whose blocks, or tree, are prepared.
        idem_errors, gicp_errors: (n, 2) of each scan and guess [deg], [m].
        verdicts: of each scan and guess.
        cache_mb: the blocks that are kept, at the end.
    """

    millions: float
    first_s: float = np.nan
    idem_ms: np.ndarray = field(default_factory=lambda: np.empty(0))
    gicp_ms: np.ndarray = field(default_factory=lambda: np.empty(0))
    idem_errors: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))
    gicp_errors: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))
    verdicts: list = field(default_factory=list)
    cache_mb: float = np.nan

    def is_right(self):
        """Return which of IDEM's results are right, (n,)."""
        return (self.idem_errors <= RIGHT).all(axis=1)


@dataclass
class Drive:
    """What came of a drive at `RATE`: (n,) milliseconds, errors (n, 2), verdicts."""

    ms: np.ndarray
    errors: np.ndarray
    verdicts: list


def measure(config, quick=False, progress=lambda steps, total=None: steps):
    """Return the `Figures` of each map, the `Drive`, a scan's time outside of a map, `FromDisk`s.

    Args:
        config: `RegistrationConfig`, but for its voxel size.
        quick: two small maps, few scans.
        progress: wraps the iteration over the maps.
    """
    warm_up()
    config = replace(config, voxel_size=VOXEL)
    millions = MILLIONS[:2] if quick else MILLIONS
    scans = [scan_at(*place, k) for k, place in enumerate(_places(2 if quick else PLACES))]
    maps = {m: MapCloud(Town(1e6 * m)) for m in millions}
    figures = [
        _of_map(m, maps[m], scans, config, 1 if quick else GUESSES)
        for m in progress(millions, len(millions))
    ]
    _time(figures, maps, scans[0], config, 3 if quick else ROUNDS)
    for of_map in figures:
        of_map.cache_mb = maps[of_map.millions].bytes / 1e6
        if of_map.millions <= GICP_UP_TO:
            _beside_gicp(of_map, scans, config, 3 if quick else ROUNDS)
    drive = _drive(MapCloud(Town(1e6 * min(DRIVEN, max(millions)))), config, 5 if quick else SCANS)
    outside = _outside(maps[millions[-1]], scans[0], config)
    apart = [scan_at(x, 1.6, 0.0, 0) for x in (-APART / 2, APART / 2)]
    disk = from_disk.measure(min(DRIVEN, max(millions)), apart, config)
    return figures, drive, outside, disk


def goals(figures, drive, outside, disk):
    """Return the figures to reach, as `Goal`s."""
    median = {each.millions: float(np.median(each.idem_ms)) for each in figures}
    (first, *_, last) = median.values()
    right = np.concatenate([each.is_right() for each in figures])
    verdicts = [v for each in figures for v in each.verdicts]
    kept = [v for v, is_right in zip(verdicts, right, strict=True) if is_right]
    missed = 100.0 * np.mean([v is not Verdict.ALIGNED for v in kept])
    low = sum(v is Verdict.LOW_OVERLAP for v in verdicts)
    least, *_, most = median
    yield Goal(f'time of a scan, {most:g} over {least:g} million points', last / first, RATIO)
    late, driven = float(np.percentile(drive.ms, 99)), f'{SPEED:g} m/s and {RATE:g} Hz'
    yield Goal(f'p99 of {len(drive.ms)} scans at {driven}', late, LATEST, 'ms')
    wrong = 100.0 * np.mean((drive.errors > RIGHT).any(axis=1))
    yield Goal('wrong scans of the drive', float(wrong), 0.0, '%')
    yield Goal(f'not aligned, of {len(kept)} right results', float(missed), SHARE, '%')
    yield Goal(f'wrong, of {len(right)} results', 100.0 * float(np.mean(~right)), 0.0, '%')
    yield Goal(f'low_overlap, of {len(verdicts)} results', float(low), 0.0)
    yield Goal('a scan outside of the map', outside, LATEST, 'ms')
    yield from from_disk.goals(disk)


def _places(count):
    """Return x, y [m] and yaw [rad] of places on the streets about the middle of the town."""
    rng = np.random.default_rng(100)
    for _ in range(count):
        along, off = rng.uniform(-6.0, 6.0), rng.choice([-1.0, 1.0]) * rng.uniform(1.0, 2.2)
        yield (along, off, rng.normal(0.0, 0.1))


def scan_at(x, y, yaw, seed):
    """Return a scan (N, 3) of the town, and its exact pose."""
    truth = se3.translation((x, y, float(height(x, y)) + SENSOR))
    truth[:2, :2] = (np.cos(yaw), -np.sin(yaw)), (np.sin(yaw), np.cos(yaw))
    scene = scene_around(x, y, LIDAR.max_range_m)
    return scan(scene, truth, LIDAR, np.random.default_rng(seed)), truth


def _errors(T, truth):
    off = se3.inverse(truth) @ T
    return np.degrees(se3.rotation_angle(off)), np.linalg.norm(off[:3, 3])


def _of_map(millions, map_, scans, config, guesses):
    figures = Figures(millions)
    rng = np.random.default_rng(7)
    errors = []
    for points, truth in scans:
        for _ in range(guesses):
            begin = perf_counter()
            found = register(map_, points, perturbed(truth, *START, rng), config)
            if np.isnan(figures.first_s):
                figures.first_s = perf_counter() - begin
            errors.append(_errors(found.T_target_source, truth))
            figures.verdicts.append(found.assessment.verdict)
    figures.idem_errors = np.array(errors)
    return figures


def _guess(truth, turn):
    return perturbed(truth, *START, np.random.default_rng(turn))


def _time(figures, maps, a_scan, config, rounds):
    """Fill the times of one scan in all maps, which take turns."""
    points, truth = a_scan

    def call(map_):
        return lambda turn: register(map_, points, _guess(truth, turn), config)

    times = interleaved_ms({f.millions: call(maps[f.millions]) for f in figures}, rounds)
    for of_map in figures:
        of_map.idem_ms = times[of_map.millions]


def _beside_gicp(figures, scans, config, rounds):
    """Fill time and errors of small_gicp's GICP in the same map, its tree prepared."""
    gicp, town = small_gicp(), Town(1e6 * figures.millions)
    points = town.points_within(*town.bounds)
    target = gicp.voxelgrid_sampling(points, VOXEL, num_threads=2)
    tree = gicp.KdTree(target, num_threads=2)
    gicp.estimate_normals_covariances(target, tree, NEIGHBOURS, num_threads=2)
    options = {**CRITERIA, 'max_correspondence_distance': 3 * VOXEL, 'num_threads': config.threads}

    def run(points, guess):
        source = gicp.voxelgrid_sampling(points, VOXEL)
        gicp.estimate_normals_covariances(source, gicp.KdTree(source), NEIGHBOURS)
        return gicp.align(target, source, tree, guess, **options).T_target_source

    figures.gicp_errors = np.array(
        [_errors(run(points, _guess(truth, k)), truth) for k, (points, truth) in enumerate(scans)]
    )
    points, truth = scans[0]
    times = interleaved_ms({'': lambda turn: run(points, _guess(truth, turn))}, rounds)
    figures.gicp_ms = times['']


def _drive(map_, config, count):
    """Drive along a street in time: each guess goes on from the result before, as a node's does.

    Blocks are prepared ahead along the motion; the first two scans find the motion out.
    """
    step = SPEED / RATE
    begin = -0.5 * step * count
    scans = [scan_at(begin + step * k, 1.6, 0.0, k) for k in range(count)]
    ms, errors, verdicts = [], [], []
    T = scans[0][1]
    register(map_, Cloud(scans[0][0]), T, config)
    motion = se3.translation((step, 0.0, 0.0))
    tick = perf_counter()
    for points, truth in scans:
        at = perf_counter()
        result = register(map_, points, T, config)
        ms.append(1e3 * (perf_counter() - at))
        errors.append(_errors(result.T_target_source, truth))
        verdicts.append(result.assessment.verdict)
        T = result.T_target_source @ motion
        ahead = T[:3, 3] + AHEAD * SPEED * T[:3, 0]
        map_.prefetch(ahead, LIDAR.max_range_m + AHEAD * SPEED)
        tick += 1.0 / RATE
        sleep(max(tick - perf_counter(), 0.0))
    return Drive(np.array(ms), np.array(errors), verdicts)


def _outside(map_, a_scan, config):
    """Return how long a scan takes that is outside of the map [ms]."""
    points, truth = a_scan
    far = se3.translation((5e4, 0.0, 0.0)) @ truth
    begin = perf_counter()
    result = register(map_, points, far, config)
    assert result.status is Status.NO_OVERLAP, result.status
    return 1e3 * (perf_counter() - begin)
