"""Scans among vehicles that drive along with the sensor, and in the same places without them."""

from functools import partial
from typing import NamedTuple
from zlib import crc32

import numpy as np

from benchmarks.case import displaced, errors
from benchmarks.goal import Goal
from benchmarks.trust.places import PLACES
from benchmarks.trust.sensors import place_case
from idem_ros.core import Cloud, RegistrationConfig, register
from idem_ros.simulation.furniture import car
from idem_ros.simulation.surfaces import Scene, box, merged, placed

FIRST_SEED = 9200
# lanes beside the sensor's own [m]
LANES = {'street': (0.0,), 'town': (0.0, 3.4), 'motorway': (-3.7, 0.0, 3.7), 'tunnel': (0.0, 3.2)}
AHEAD = 35.0  # [m]: as far there are vehicles, to either side
GAPS = (2.5, 9.0)  # [m], between two of a lane
CLEAR = 4.5  # [m], ahead of the sensor and behind it in its own lane
LORRIES = 0.3  # of the vehicles
NEAR = (1.5, 1.0)  # [deg], spacings, of the start; another is no motion, where vehicles coincide
WRONG_M, WRONG_DEG = 0.1, 0.57
SAID = 'move along'  # in the reason
MOST_WRONG, MOST_SAID = 1.0, 0.0  # [%]


class Told(NamedTuple):
    """What was told of one registration."""

    kind: str
    vehicles: bool
    right: bool
    usable: bool
    said: bool


def convoy(lanes, rng):
    """Return vehicles as they stand around a sensor, x ahead, z = 0 on the ground."""
    parts = []
    for lane in lanes:
        x = rng.uniform(-AHEAD, -AHEAD + GAPS[1])
        while x < AHEAD:
            is_lorry = rng.random() < LORRIES
            length = rng.uniform(7.0, 12.0) if is_lorry else 5.5
            middle = x + length / 2
            if lane or abs(middle) > length / 2 + CLEAR:
                vehicle = lorry(length, rng) if is_lorry else car(rng)
                parts.append(placed(vehicle, middle, lane + rng.normal(0.0, 0.1)))
            x += length + rng.uniform(*GAPS)
    return merged(parts)


def lorry(length, rng):
    """Return a lorry, x forward: its cab, its load and what lies between and below."""
    end, tall = length / 2, rng.uniform(3.2, 3.9)
    cab = box((end - 2.0, -1.2, 0.5), (end, 1.2, rng.uniform(2.6, 3.2)))
    load = box((-end, -1.25, 1.1), (end - 2.4, 1.25, tall))
    return Scene(boxes=[cab, load, box((-end, -0.5, 0.6), (end - 2.0, 0.5, 1.1))])


def told_of(kind, seed, vehicles):
    """Return the `Told` of a case, from near the truth and from no motion."""
    around = partial(convoy, LANES[kind]) if vehicles else None
    case = place_case(kind, seed, around)
    rng = np.random.default_rng(crc32(case.name.encode()))
    target, source = Cloud(case.target), Cloud(case.source)
    config = RegistrationConfig(voxel_size=case.voxel_size)
    degrees, spacings = NEAR
    near = displaced(case.truth, case.centroid, degrees, spacings * case.spacing, rng)
    return [_told(case, vehicles, kind, target, source, T, config) for T in (near, np.eye(4))]


def _told(case, vehicles, kind, target, source, guess, config):
    result = register(target, source, guess, config)
    turned, off = errors(case, result.T_target_source)
    right = turned < WRONG_DEG and off < WRONG_M
    said = SAID in result.assessment.reason
    return Told(kind, vehicles, right, result.is_usable, said)


def convoy_tasks(trials):
    """Return functions that return `Told`s: in each kind with vehicles; in all without."""
    seeds = range(FIRST_SEED, FIRST_SEED + trials)
    return [partial(told_of, kind, seed, True) for kind in LANES for seed in seeds] + [
        partial(told_of, kind, seed, False) for kind in ('street', *PLACES) for seed in seeds
    ]


def convoy_goals(found):
    """Return the `Goal`s of `Told`s."""
    among = [each for each in found if each.vehicles]
    alone = [each for each in found if each.right and not each.vehicles]
    wrong = 100.0 * np.mean([each.usable and not each.right for each in among])
    right = [each.usable for each in among if each.right]
    what = f'{sum(right)} of {len(right)} right ones called so'
    what = f'convoys: wrong and called aligned, of {len(among)} ({what})'
    yield Goal(what, wrong, MOST_WRONG, '%')
    said = 100.0 * np.mean([each.said for each in alone])
    yield Goal(
        f'convoys: named where there is none, of {len(alone)} right ones', said, MOST_SAID, '%'
    )
