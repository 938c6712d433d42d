"""Two furnished rooms and the doorway between them, for a sensor that is carried through."""

from typing import NamedTuple

import numpy as np

from idem_ros.simulation.furniture import (
    cartons,
    cupboard,
    pillar,
    plant,
    radiator,
    shelf,
    table,
)
from idem_ros.simulation.surfaces import Floor, Scene, box, curve, merged, placed

THICK = 0.2  # [m], of the wall between the rooms, and of floor and ceiling
DEEP = 0.4  # [m], of the outer walls
LINTEL = 2.15
CLEAR = 0.9  # [m] to either side of the route: a carried sensor wanders by 0.3 m
FURNISHED = 0.7  # [m] along the walls


class _Rectangle(NamedTuple):
    """One room seen from above."""

    west: float
    south: float
    east: float
    north: float


def room(rng):
    """Return two rooms of 8 to 12 m by 7 to 10 m, floor at z = 0; the route leads through both."""
    height, width = rng.uniform(2.7, 3.3), rng.uniform(8.0, 12.0, 2)
    south, depth = rng.uniform(-1.0, 1.0), rng.uniform(7.0, 10.0, 2)
    first = _Rectangle(-width[0], 0.0, 0.0, depth[0])
    second = _Rectangle(THICK, south, THICK + width[1], south + depth[1])
    door = rng.uniform(2.5, 4.5), rng.uniform(1.3, 1.8)  # its middle, and how wide it is
    route = curve(_corners(first, second, door[0], rng))
    parts = [_shell(first, second, height), _doorway(first, second, door, height)]
    for rectangle, shared in ((first, 'east'), (second, 'west')):
        parts += _walls(rectangle, shared, door, height, rng)
        parts += _furniture(rectangle, route, height, rng)
        parts += _ceiling(rectangle, height, rng)
    whole = merged(parts, route=np.column_stack([route, np.zeros(len(route))]))
    return placed(whole, 0.0, 0.0, yaw=rng.uniform(0.0, 2 * np.pi))


def _corners(first, second, door, rng):
    """Where the route bends: about each room, and straight through the doorway."""
    rooms = (first, first, second, second)
    y = [r.south + rng.uniform(0.3, 0.7) * (r.north - r.south) for r in rooms]
    return [
        (first.west + 2.2, y[0]),
        (0.55 * first.west, y[1]),
        (-1.0, door),
        (THICK + 1.0, door),
        (0.55 * second.east, y[2]),
        (second.east - 2.2, y[3]),
    ]


def _shell(first, second, height):
    """One floor and one ceiling for both rooms."""
    low = (first.west - 1.0, min(first.south, second.south) - 1.0)
    high = (second.east + 1.0, max(first.north, second.north) + 1.0)
    slabs = [box((*low, z), (*high, z + THICK)) for z in (-THICK, height)]
    return Scene(boxes=slabs)


def _doorway(first, second, door, height):
    """The wall between the rooms, with an opening and its frame."""
    low, high = min(first.south, second.south), max(first.north, second.north)
    left, right = door[0] - door[1] / 2, door[0] + door[1] / 2
    rows = [
        box((0.0, low, 0.0), (THICK, left, height)),
        box((0.0, right, 0.0), (THICK, high, height)),
        box((0.0, left, LINTEL), (THICK, right, height)),
    ]
    for y in (left, right):
        rows.append(box((-0.05, y - 0.06, 0.0), (THICK + 0.05, y + 0.06, LINTEL)))
    return Scene(boxes=rows)


def _walls(rectangle, shared, door, height, rng):
    """The outer walls, clockwise, and what stands along all four of them."""
    west, south, east, north = rectangle
    sides = {
        'north': (west, north, 0.0, east - west),
        'east': (east, north, -np.pi / 2, north - south),
        'south': (east, south, np.pi, east - west),
        'west': (west, south, np.pi / 2, north - south),
    }
    for name, (x, y, yaw, length) in sides.items():
        if name == shared:
            aside = door[0] - south if name == 'west' else north - door[0]
            line = _along_wall(length, (aside - 1.6, aside + 1.6), (shelf, cupboard), rng)
        elif name in ('north', 'south'):
            line = [_windows(length, height, rng), *_along_wall(length, (), (radiator,), rng)]
        else:
            wall = Scene(boxes=[box((0.0, 0.0, 0.0), (length, DEEP, height))])
            line = [wall, *_along_wall(length, (), (shelf, cupboard), rng)]
        yield placed(merged(line), x, y, yaw=yaw)


def _windows(length, height, rng):
    """An outer wall, x from 0 to `length`, its face at y = 0; the panes lie behind it, at +y."""
    sill, head = rng.uniform(0.8, 1.0), height - rng.uniform(0.3, 0.6)
    recess = rng.uniform(0.15, 0.3)
    rows = [
        box((0.0, recess, 0.0), (length, DEEP, height)),
        box((0.0, 0.0, 0.0), (length, recess, sill)),
        box((0.0, 0.0, head), (length, recess, height)),
        box((0.0, -0.1, sill - 0.04), (length, 0.0, sill)),
    ]
    x = 0.0
    while x < length:
        pier = min(rng.uniform(0.5, 1.4), length - x)
        rows.append(box((x, 0.0, sill), (x + pier, recess, head)))
        x += pier + rng.uniform(1.2, 2.4)
    return Scene(boxes=rows)


def _along_wall(length, free, kinds, rng):
    """Furniture with its back to a wall, x from 0 to `length`, none within the interval `free`."""
    x = rng.uniform(FURNISHED, 1.3)
    while True:
        width = rng.uniform(0.8, 1.7)
        if x + width > length - FURNISHED:
            return
        if not free or x > free[1] or x + width < free[0]:
            build = kinds[int(rng.integers(len(kinds)))]
            yield placed(build(rng, width), x, 0.0)
        x += width + rng.choice([0.05, 0.4, 1.2])


def _furniture(rectangle, route, height, rng):
    """What stands about a room, off the walls and the route."""
    low = np.array(rectangle[:2]) + FURNISHED
    floor = Floor(low, np.array(rectangle[2:]) - FURNISHED, route, CLEAR)
    kinds = [(table, 1.4)] * 3 + [(pillar, 0.4)] * 2 + [(cartons, 0.6)] * 4 + [(plant, 0.6)] * 3
    for build, radius in kinds:
        place = floor.take(rng, radius)
        if place is not None:
            part = build(rng, height) if build is pillar else build(rng)
            yield placed(part, *place, yaw=rng.uniform(0.0, 2 * np.pi))


def _ceiling(rectangle, height, rng):
    """A beam across, and lamps that hang from the ceiling."""
    west, south, east, north = rectangle
    x, drop = rng.uniform(0.3, 0.7) * (east - west) + west, rng.uniform(0.15, 0.3)
    yield Scene(boxes=[box((x, south, height - drop), (x + 0.25, north, height))])
    for x, y in rng.uniform((west + 1, south + 1), (east - 1, north - 1), (4, 2)):
        low = height - rng.uniform(0.4, 0.6)
        yield Scene(cylinders=[(x, y, low, low + 0.15, 0.2), (x, y, low, height, 0.02)])
