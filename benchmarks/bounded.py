"""What garbage costs beside honest clouds of as many points, and how well budgets are kept."""

from dataclasses import dataclass, replace
from time import perf_counter, process_time

import numpy as np

from benchmarks.goal import Goal
from idem_ros.core import Cloud, MapCloud, RegistrationConfig, register, register_all
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.simulation.drive import drive, perturbed
from idem_ros.simulation.forest import forest
from idem_ros.simulation.lidar import Lidar, scan
from idem_ros.simulation.room import room
from idem_ros.simulation.street import street
from idem_ros.simulation.tunnel import tunnel

COST = 5.0  # times the slowest honest cloud
SHARE, SLACK_MS = 1.2, 20.0  # of a budget, or beyond it
SIZES, QUICK_SIZES = (5_000, 20_000, 60_000), (3_000,)
BUDGETS, QUICK_BUDGETS = (20.0, 100.0), (20.0,)  # [ms]
VOXELS = (None, 'auto', 0.5)
RINGS, SWEEP = 64, 0.1
PLACES = street, room, forest, tunnel


@dataclass(frozen=True)
class Scene:
    """Scans of one drive, each of as many points, and the guess of the second in the first."""

    scans: list
    guess: np.ndarray


def scene(kind, points, rng):
    """Return a `Scene` of one of `PLACES`."""
    place = kind(rng)
    steps = int(1.5 * points / RINGS)
    lidar = Lidar(RINGS, -24.8, 15.0, steps, range_noise_m=0.02, max_range_m=120.0)
    poses = drive(place, 12, rng)[:3]
    scans = [_exactly(points, scan(place, pose, lidar, rng), rng) for pose in poses]
    return Scene(scans, perturbed(inverse(poses[0]) @ poses[1], 1.5, 0.3, rng))


def garbage(n, rng):
    """Return {kind: (n, 3)} of what is no scan."""
    with np.errstate(invalid='ignore'):  # signalling NaNs
        floats = np.frombuffer(rng.bytes(12 * n), '<f4').reshape(-1, 3).astype(np.float64)
    away = 1e3 * rng.integers(0, 2, (n, 1))
    return {
        'random floats': floats,
        'of any size': 10.0 ** rng.uniform(-8, 7, (n, 3)) * rng.choice([-1, 1], (n, 3)),
        'of heavy tails': rng.standard_cauchy((n, 3)),
        'of fat tails': rng.normal(size=(n, 3)) / rng.uniform(1e-6, 1, (n, 1)),
        'of thin tails': 5.0 * rng.standard_t(3, (n, 3)),
        'in a ball and far off': rng.normal(size=(n, 3)) * rng.choice([1, 100], (n, 1)),
        'in two places': away + rng.normal(size=(n, 3)),
        'in a line': np.linspace(-100, 100, n)[:, None] * (1.0, 0.3, 0.0),
        'in one place': np.ones((n, 3)),
        'all over a box': rng.uniform((-100, -100, -10), (100, 100, 10), (n, 3)),
    }


def costs(points, voxel_size, rng):
    """Yield (`Goal`, of whom) of garbage of so many points, in a cloud and in a map."""
    config = RegistrationConfig(voxel_size=voxel_size)
    honest = [scene(kind, points, rng) for kind in PLACES]
    for as_target in (Cloud, MapCloud):
        targets = [as_target(each.scans[0]) for each in honest]
        slowest = max(
            _seconds(as_target(each.scans[0]), each.scans[1], each.guess, config)
            for each in honest
        )
        for name, cloud in garbage(points, rng).items():
            took = _seconds(targets[0], cloud, honest[0].guess, config)
            where = 'cloud' if as_target is Cloud else 'map'
            yield Goal(
                f'{name}, {points} points, voxels {voxel_size}, in a {where}', took / slowest, COST
            )


def overruns(points, budget_ms, rng):
    """Yield `Goal`s of how much longer than allowed a registration takes by the clock [ms]."""
    some = scene(street, points, rng)
    config = RegistrationConfig(voxel_size=0.5, budget_ms=budget_ms)
    target, source, third = some.scans
    times = SWEEP * np.linspace(0.0, 1.0, points)
    moving = replace(config, motion='solve')
    calls = {
        'a cloud': lambda: register(target, source, some.guess, config),
        'points as given': lambda: register(
            target, source, some.guess, replace(config, voxel_size=None)
        ),
        'an audit': lambda: register(target, source, some.guess, replace(config, mode='audit')),
        'a map': lambda: register(MapCloud(target), source, some.guess, config),
        'a sweep': lambda: register(target, Cloud(source, times=times), some.guess, moving),
        'several': lambda: register_all([target, source, third], None, config),
        **{
            f'garbage {name}': lambda cloud=cloud: register(target, cloud, some.guess, config)
            for name, cloud in garbage(points, rng).items()
        },
    }
    allowed = max(SHARE * budget_ms, budget_ms + SLACK_MS)
    for name, call in calls.items():
        call()  # compiled, and the memory there
        begin = perf_counter()
        call()
        over = 1e3 * (perf_counter() - begin) - allowed
        yield Goal(
            f'{name}, {points} points, budget {budget_ms:g} ms: over', max(over, 0.0), 0.0, 'ms'
        )


def measure(quick, progress):
    """Return the `Goal`s of costs, and those of budgets."""
    rng, sizes = np.random.default_rng(0), QUICK_SIZES if quick else SIZES
    asked = [(n, voxel_size) for n in sizes for voxel_size in VOXELS]
    limits = [(n, ms) for n in sizes for ms in (QUICK_BUDGETS if quick else BUDGETS)]
    return (
        [goal for n, voxel_size in progress(asked) for goal in costs(n, voxel_size, rng)],
        [goal for n, ms in progress(limits) for goal in overruns(n, ms, rng)],
    )


def _seconds(target, source, guess, config):
    """Return what a registration takes of the processor [s], the second time."""
    source = transform_points(np.eye(4), source)
    for _ in range(2):
        begin = process_time()
        register(target, source, guess, config)
        took = process_time() - begin
    return took


def _exactly(count, points, rng):
    return points[np.sort(rng.choice(len(points), count, replace=len(points) < count))]
