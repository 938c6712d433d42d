"""Places that no number was fitted on: built of boxes, posts and ground, a sensor in their midst.

Each is a function of a random generator that returns a `Scene`, x along, z = 0 on the ground.
"""

import numpy as np

from idem_ros.simulation.furniture import bush, car, house, lamp_post, tree
from idem_ros.simulation.surfaces import Scene, box, merged, mesh, placed

HALF = 40.0  # [m]: open ground reaches so far from the middle
LONG = 70.0  # [m]: a tunnel does


def town(rng):
    """Return a crossing of two streets between houses, with cars and lamps at the kerbs."""
    parts = [_ground(rng, 0.01)]
    for quarter in range(4):
        for x in np.arange(7.0, 35.0, 10.5):
            front = house(rng, rng.uniform(8.0, 10.4), int(rng.integers(2, 5)))
            parts.append(_turned(placed(front, x, 7.0 + rng.uniform(-0.7, 0.7)), quarter))
            if rng.random() < 0.7:
                at = x + rng.uniform(0, 5), 4.6 + rng.normal(0.0, 0.1)
                parts.append(_turned(placed(car(rng), *at, yaw=rng.normal(0.0, 0.04)), quarter))
        parts.append(_turned(placed(lamp_post(rng), rng.uniform(8, 25), 5.9), quarter))
    return merged(parts)


def warehouse(rng):
    """Return a hall with rows of racks, whose bays hold pallets or nothing."""
    wide = 22.0
    parts = [Scene(boxes=[box((-30, -wide, 0), (30, wide, 8.0))])]
    for y in np.arange(3.0 - wide, wide, 4.6):
        if abs(y) > 1.6:
            bays = np.arange(-24.0, 24.0, 2.8)
            parts += [_bay(rng, x, y) for x in bays if rng.random() < 0.93]
    return merged(parts)


def _bay(rng, x, y, deep=1.1, wide=2.8):
    sides = y, y + deep
    rows = [box((x, side - 0.05, 0), (x + 0.1, side + 0.05, 6.0)) for side in sides]
    for level in (0.1, 1.8, 3.5):
        if level > 1.0:
            low, high = level - 0.12, level
            rows += [box((x, s - 0.03, low), (x + wide, s + 0.03, high)) for s in sides]
        for k in range(2):
            if rng.random() < 0.7:
                shift = rng.uniform((0.15, -0.1), (0.3, 0.1))
                low = np.array([x + 1.35 * k, y, level]) + [*shift, 0.0]
                rows.append(box(low, low + rng.uniform((0.9, 0.9, 0.5), (1.15, 1.1, 1.5))))
    return Scene(boxes=rows)


def motorway(rng):
    """Return lanes between crash barriers on posts, gantries, few cars, embankments."""
    y = np.array([-40, -22, -15, -14.9, 0, 14.9, 15, 22, 40.0])
    z = np.array([6, 3.0, 0.1, 0, 0, 0, 0.1, -2, -3.0]) * rng.choice([-1, 1])
    grid = np.stack(np.meshgrid(np.arange(-60.0, 61.0, 6.0), y, indexing='ij'), axis=2)
    rough = np.where(np.abs(y) > 15, 0.2, 0.01)
    heights = z + rough * rng.normal(size=grid.shape[:2])
    rows = []
    for side in (-14.0, -0.6, 0.6, 14.0):
        rows.append(box((-60, side - 0.04, 0.45), (60, side + 0.04, 0.76)))
        feet = np.arange(rng.uniform(0, 4) - 60, 60, 4.0)
        rows += [box((x, side - 0.05, -0.3), (x + 0.12, side + 0.05, 0.7)) for x in feet]
    gantries = rng.uniform(-45, 45, 2)
    rows += [box((x - 0.3, -16, 5.6), (x + 0.3, 16, 6.6)) for x in gantries]
    posts = [(x, side, -0.3, 6.5, 0.25) for x in gantries for side in (-16.0, 16.0)]
    ground = mesh(np.concatenate([grid, heights[:, :, None]], axis=2))
    parts = [Scene(triangles=ground, boxes=rows, cylinders=posts)]
    for lane in (-11.5, -3.8, 3.8, 7.5, 11.5):
        if rng.random() < 0.5:
            parts.append(placed(car(rng), rng.uniform(-40, 40), lane + rng.normal(0, 0.2)))
    for _ in range(14):
        at = rng.uniform(-50, 50), rng.choice([-1, 1]) * rng.uniform(17, 24)
        parts.append(placed(bush(rng, 1.5), *at, float(np.interp(at[1], y, z))))
    return merged(parts)


def parking_deck(rng):
    """Return a low storey on a grid of pillars under beams, with parked cars."""
    tall = rng.uniform(2.3, 2.8)
    rows = [box((-32, -18, 0), (32, 18, tall))]
    for x in np.arange(-30.0, 31.0, 7.5):
        feet = (-11.0, -3.5, 3.5, 11.0)
        rows += [box((x - 0.25, y - 0.25, 0), (x + 0.25, y + 0.25, tall)) for y in feet]
        rows.append(box((x - 0.2, -18, tall - 0.35), (x + 0.2, 18, tall)))
    parts = [Scene(boxes=rows)]
    for y, yaw in ((-15.2, 0.5), (-5.9, 1.5), (5.9, 0.5), (15.2, 1.5)):
        for x in np.arange(-28.5, 29.0, 2.5):
            if rng.random() < 0.5 and abs(x % 7.5) > 0.9:
                at = x + rng.normal(0, 0.1), y + rng.normal(0, 0.15)
                parts.append(placed(car(rng), *at, yaw=np.pi * yaw + rng.normal(0, 0.03)))
    return merged(parts)


def field(rng):
    """Return rolling open ground with a few trees, bushes and a fence's posts."""
    parts = [_ground(rng, 0.05, 0.2)]
    for _ in range(int(rng.integers(5, 10))):
        parts.append(placed(tree(rng, 2.0, 2.2), *_around(rng, 6, 35)))
    parts += [placed(bush(rng), *_around(rng, 5, 30)) for _ in range(12)]
    posts = [(x, 9.0 + 0.1 * x, -0.5, 1.2, 0.06) for x in np.arange(-35, 35, 3.0)]
    return merged([*parts, Scene(cylinders=posts)])


def tunnel(rng, every=25.0):
    """Return a tunnel of two lanes with niches at random, so far apart on average [m]."""
    half = 5.0
    rows = [box((-LONG, -half, 0), (LONG, half, 6.0))]
    for side in (-1, 1):
        kerb = side * half
        rows.append(box((-LONG, kerb - 0.9, 0), (LONG, kerb + 0.9, 0.3)))
        x = rng.uniform(0, every) - LONG
        while x < LONG:
            wide, deep = rng.uniform(1.0, 2.5), rng.uniform(0.5, 1.2)
            low, high = sorted((kerb, side * (half - deep)))
            rows.append(box((x, low, -0.2), (x + wide, high, rng.uniform(1.9, 2.6))))
            x += rng.uniform(0.3, 1.7) * every
    return Scene(boxes=rows)


def woods(rng):
    """Return trees close together on rough ground, undergrowth between them."""
    parts = [_ground(rng, 0.12, 0.32)]
    for x, y in rng.uniform(-HALF, HALF, (170, 2)):
        if np.hypot(x, y) > 2.0 and abs(y) > 1.2:
            crown = rng.uniform((2.0, 1.0), (5.0, 2.2))
            parts.append(placed(tree(rng, *crown, 8), x, y))
            if rng.random() < 0.3:
                parts.append(placed(bush(rng), x + 1.3, y - 1.1))
    return merged(parts)


PLACES = {
    each.__name__: each for each in (town, warehouse, motorway, parking_deck, field, tunnel, woods)
}


def _around(rng, least, most):
    angle = rng.uniform(0.0, 2 * np.pi)
    return rng.uniform(least, most) * np.array([np.cos(angle), np.sin(angle)])


def _turned(part, quarter):
    return placed(part, 0.0, 0.0, yaw=quarter * np.pi / 2)


def _ground(rng, rough, waves=0.0):
    line = np.arange(-HALF, HALF + 1.0, 2.5)
    x, y = np.meshgrid(line, line, indexing='ij')
    z = rng.normal(0.0, rough, x.shape)
    for _ in range(4):
        along = rng.normal(0.0, 0.12, 2)
        z += waves * np.sin(along[0] * x + along[1] * y + rng.uniform(0, 2 * np.pi))
    return Scene(triangles=mesh(np.stack([x, y, z], axis=2)))
