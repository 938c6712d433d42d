"""A residential street that bends and rises gently, with two uneven sides."""

from dataclasses import dataclass

import numpy as np

from idem_ros.simulation.furniture import bush, car, house, lamp_post, sign, street_box, tree
from idem_ros.simulation.surfaces import Scene, box, merged, mesh, placed

LENGTH = 130.0
KERB = 5.2  # [m] from the centre line to either kerb: a lane and a parking bay
KERB_HEIGHT = 0.13
PAVEMENT = {1: 2.1, -1: 3.3}  # [m] width on the left (+1) and on the right (-1)
DRIVEN = (40.0, 90.0)  # [m] along the street
LANE = -1.5  # [m]: traffic keeps to the right


@dataclass(frozen=True, eq=False)
class _CentreLine:
    """The middle of the street: plane curve and height by the distance s along it."""

    s: np.ndarray
    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    heading: np.ndarray

    def at(self, s, offset=0.0):
        """Return x, y, z and heading `offset` to the left of the line at s, on the ground."""
        heading = np.interp(s, self.s, self.heading)
        x = np.interp(s, self.s, self.x) - offset * np.sin(heading)
        y = np.interp(s, self.s, self.y) + offset * np.cos(heading)
        camber = -0.02 * np.minimum(np.abs(offset), KERB)
        raised = np.where(np.abs(offset) > KERB, KERB_HEIGHT, 0.0)
        return x, y, np.interp(s, self.s, self.z) + camber + raised, heading


def street(rng):
    """Return a street of some 130 m: houses, cars, trees, posts, kerbs; z = 0 near its middle."""
    line = _centre_line(rng)
    parts = [Scene(triangles=mesh(_ground(line, rng)))]
    for side in (1, -1):
        parts += _houses(line, side, rng)
        parts += _pavement(line, side, rng)
        parts += _parked_cars(line, side, rng)
    s = np.arange(DRIVEN[0], DRIVEN[1] + 0.05, 0.1)
    return merged(parts, route=np.column_stack(line.at(s, LANE)[:3]))


def _centre_line(rng):
    step = 0.1
    s = np.arange(0.0, LENGTH + step, step)
    bend, start, phase = rng.uniform(0.12, 0.22), rng.uniform(0, 2 * np.pi), rng.uniform(0, 2)
    heading = start + bend * np.sin(2 * np.pi * s / LENGTH + phase)
    x, y = np.cumsum(step * np.cos(heading)), np.cumsum(step * np.sin(heading))
    z = rng.uniform(0.2, 0.4) * np.sin(2 * np.pi * s / 90 + phase) + 0.008 * (s - LENGTH / 2)
    middle = len(s) // 2
    return _CentreLine(s, x - x[middle], y - y[middle], z, heading)


def _ground(line, rng):
    """The vertices of the road, the kerbs and the pavements, uneven by a centimetre or two."""
    edge = KERB + 1e-3
    offsets = np.array([-25, -14, -8.5, -edge, -KERB, -2.6, 0, 2.6, KERB, edge, 7.3, 14, 25])
    s, offset = np.meshgrid(np.arange(0.0, LENGTH + 0.1, 4.0), offsets, indexing='ij')
    x, y, z, _ = line.at(s, offset)
    bumps = rng.normal(0.0, 0.015, s.shape)
    bumps[:, [3, 9]] = bumps[:, [4, 8]]  # upper and lower edge of a kerb go up and down together
    return np.stack([x, y, z + bumps], axis=2)


def _houses(line, side, rng):
    """Houses, set back unevenly, with drives, garden walls and hedges between some of them."""
    s = rng.uniform(-4.0, 2.0)
    while s < LENGTH - 8.0:
        if rng.random() < 0.3:
            gap = rng.uniform(3.5, 7.5)
            yield from _gap(line, side, s, gap, rng)
            s += gap
        width, storeys = rng.uniform(7.5, 13.5), int(rng.integers(2, 5))
        setback = KERB + PAVEMENT[side] + max(0.0, rng.normal(0.5, 0.8))
        yield _along(line, side, house(rng, width, storeys), s, width, setback)
        s += width + rng.choice([0.0, 0.1, 1.2])


def _gap(line, side, s, gap, rng):
    """A garden wall before trees and a shed, or a bare drive with a shed at its end."""
    front = KERB + PAVEMENT[side]
    shed = Scene(boxes=[box((0.5, 0.0, -0.4), (gap - 0.5, 3.0, rng.uniform(2.3, 3.2)))])
    yield _along(line, side, shed, s, gap, front + rng.uniform(7.0, 11.0))
    if rng.random() < 0.6:
        wall = Scene(boxes=[box((0.0, 0.0, -0.4), (gap, 0.25, rng.uniform(0.9, 1.7)))])
        yield _along(line, side, wall, s, gap, front)
        yield _standing(line, side, tree(rng), s + gap / 2, front + 2.8, rng)


def _pavement(line, side, rng):
    """Trees, lamps, signs and what else stands between the kerb and the fronts."""
    near, far = KERB + 0.5, KERB + PAVEMENT[side] - 0.45
    rows = [
        (tree, 9.0 if side < 0 else 24.0, near + 0.3),
        (lamp_post, 27.0, near),
        (sign, 19.0, near),
        (street_box, 8.0, far),
        (bush, 21.0, far),
    ]
    for build, spacing, offset in rows:
        for s in np.arange(rng.uniform(1.0, spacing), LENGTH - 2.0, spacing):
            shift, sideways = rng.uniform(-0.3, 0.3) * spacing, rng.uniform(-0.15, 0.15)
            yield _standing(line, side, build(rng), s + shift, offset + sideways, rng)


def _parked_cars(line, side, rng):
    s = rng.uniform(2.0, 8.0)
    while s < LENGTH - 4.0:
        if rng.random() < 0.7:
            yield _standing(line, side, car(rng), s, KERB - 1.05 - rng.uniform(0, 0.15), rng)
        s += rng.uniform(5.4, 7.2)


def _along(line, side, part, s, width, offset):
    """Place a part of some width by the chord of the street, its face (y = 0) at the offset."""
    middle = s + width / 2
    x, y, z, heading = line.at(middle, side * offset)
    yaw = heading if side > 0 else heading + np.pi
    dx, dy = -width / 2 * np.cos(yaw), -width / 2 * np.sin(yaw)
    return placed(part, float(x + dx), float(y + dy), float(z), float(yaw))


def _standing(line, side, part, s, offset, rng):
    """Place a part on the ground, +y away from the road, turned by a few degrees at random."""
    x, y, z, heading = line.at(s, side * offset)
    yaw = heading + rng.normal(0.0, 0.03) + (0.0 if side > 0 else np.pi)
    return placed(part, float(x), float(y), float(z), float(yaw))
