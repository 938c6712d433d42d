"""A road tunnel with niches, cabinets, lamps and signs at random, that bends a little."""

import numpy as np

from idem_ros.simulation.furniture import car, street_box
from idem_ros.simulation.surfaces import Scene, box, curve, merged, mesh, placed

LENGTH = 140.0  # [m]
DRIVEN = (35.0, 105.0)  # [m] along it
HALF_WIDTH, HEIGHT = 4.6, 5.2  # [m]
LANE = -1.7  # [m]: to the left of the middle where positive
SIDES = 9  # corners of the arch


def tunnel(rng):
    """Return a tunnel of some 140 m, floor at z = 0; along it little but what is put up holds."""
    line = curve(np.array([(0.0, 0.0), (LENGTH / 2, rng.uniform(-3.0, 3.0)), (LENGTH, 0.0)]))
    along = np.linspace(0.0, LENGTH, len(line))
    parts = [Scene(triangles=mesh(_walls(line)))]
    for side in (1, -1):
        for s in np.arange(rng.uniform(3.0, 12.0), LENGTH - 3.0, 12.0):
            build = (_niche, _cabinet, _sign)[rng.integers(3)]
            parts.append(_beside(build(rng), line, along, s + rng.uniform(-3.0, 3.0), side))
        for s in np.arange(rng.uniform(0.0, 8.0), LENGTH, 8.0):
            parts.append(_beside(_lamp(), line, along, s, side))
    for s in rng.uniform(DRIVEN[0], DRIVEN[1], 2):
        parts.append(_beside(car(rng), line, along, s, 1, HALF_WIDTH - 2.9))
    driven = (along >= DRIVEN[0]) & (along <= DRIVEN[1])
    normal = _left_of(line)
    route = np.column_stack([line + LANE * normal, np.zeros(len(line))])[driven]
    return placed(merged(parts, route=route), 0.0, 0.0, yaw=rng.uniform(0.0, 2 * np.pi))


def _left_of(line):
    ahead = np.gradient(line, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    return np.column_stack([-ahead[:, 1], ahead[:, 0]])


def _walls(line):
    """The vertices of floor, walls and arch, at every fifth metre, closed around."""
    some = line[:: max(len(line) // 28, 1)]
    left = _left_of(some)
    angle = np.linspace(0.0, np.pi, SIDES)
    across = np.concatenate([[HALF_WIDTH], HALF_WIDTH * np.cos(angle), [-HALF_WIDTH, HALF_WIDTH]])
    spring = HEIGHT - 1.8
    up = np.concatenate([[0.0], spring + 1.8 * np.sin(angle), [0.0, 0.0]])
    flat = some[:, None, :] + across[None, :, None] * left[:, None, :]
    return np.concatenate([flat, np.broadcast_to(up[None, :, None], (*flat.shape[:2], 1))], axis=2)


def _beside(part, line, along, s, side, off=HALF_WIDTH):
    """Return a part, whose back is at y = 0 and its front towards -y, at a wall at s."""
    at = min(max(int(np.searchsorted(along, s)), 1), len(line) - 2)
    left = _left_of(line[at - 1 : at + 2])[1]
    x, y = line[at] + side * off * left
    ahead = np.arctan2(-left[0], left[1])
    return placed(part, x, y, yaw=ahead if side > 0 else ahead + np.pi)


def _niche(rng):
    """Two pillars and what stands between them: the frame of a niche."""
    half, deep = rng.uniform(0.7, 1.6), rng.uniform(0.25, 0.5)
    posts = [box((x - 0.2, -deep, 0.0), (x + 0.2, 0.1, 2.6)) for x in (-half, half)]
    return Scene(boxes=[*posts, box((-half, -deep, 2.4), (half, 0.1, 2.7))])


def _cabinet(rng):
    return placed(street_box(rng), 0.0, -rng.uniform(0.5, 0.7))


def _sign(rng):
    """A sign that stands out from the wall."""
    low = rng.uniform(1.8, 2.6)
    return Scene(boxes=[box((-0.04, -rng.uniform(0.5, 0.9), low), (0.04, 0.0, low + 0.6))])


def _lamp():
    return Scene(boxes=[box((-0.5, -0.75, 3.9), (0.5, -0.45, 4.05))])
