"""Tunnels, facades, walls and planes, bare or with what holds them; ordinary scenes beside."""

from dataclasses import dataclass

import numpy as np

from idem_ros.simulation.forest import forest
from idem_ros.simulation.room import room
from idem_ros.simulation.street import street
from idem_ros.simulation.surfaces import Scene, box, mesh

LONG = 200.0  # [m]: half a bare scene's length, beyond any range
THICK = 3.0
INTO = 0.1  # [m]: farther than noise
FACETS = 24  # of a round tunnel's profile


@dataclass(frozen=True, eq=False)
class Place:
    """A scene along x with the sensor's way in its middle, and what it determines.

    Attributes:
        scene: the `Scene`.
        free: names of the motions that it leaves free: of 'x', 'y', 'rz'.
        holders: (n, 6) boxes, lowest and highest corner, in which what holds x is hit: niches or
            posts.
        height: of the sensor above the ground [m].
        wanted: holders in sight from which on a result must be right and aligned.
    """

    scene: Scene
    free: tuple = ()
    holders: np.ndarray = ()
    height: float = 1.6
    wanted: int = 0


def bare_tunnel(rng):
    """Return a tunnel without any feature, rectangular or round."""
    width, height = rng.uniform(4, 8), rng.uniform(3, 6)
    if rng.random() < 0.3:
        return Place(Scene(triangles=_round(max(width, 5.0))), ('x',))
    return Place(Scene(boxes=[box((-LONG, -width / 2, 0), (LONG, width / 2, height))]), ('x',))


def two_facades(rng):
    """Return two plain facades and the ground between them."""
    return Place(Scene(boxes=_facades(rng)), ('x',))


def wall_and_plane(rng):
    """Return the ground and one wall."""
    return Place(Scene(boxes=_facades(rng)[:2]), ('x',))


def open_plane(rng):
    """Return level ground."""
    del rng
    return Place(Scene(boxes=[_ground()]), ('x', 'y', 'rz'))


def niches(rng):
    """Return a tunnel with a niche at random in each 25 or 40 m of either wall."""
    width, height = rng.uniform(4, 8), rng.uniform(3.5, 6)
    each = rng.choice([25.0, 40.0])
    rows = [
        box((-LONG, -width, -THICK), (LONG, width, 0.0)),
        box((-LONG, -width, height), (LONG, width, height + THICK)),
    ]
    found = []
    for side in (-1, 1):
        begin = -LONG
        for cell in np.arange(-LONG, LONG, each):
            length, deep, high = rng.uniform(1.5, 3), rng.uniform(0.5, 1.5), rng.uniform(2, 2.8)
            at = cell + rng.uniform(0.5, each - length - 0.5)
            rows.append(_beside(side, (begin, at), width / 2, (0.0, height)))
            rows.append(_beside(side, (at, at + length), width / 2, (high, height)))
            rows.append(_beside(side, (at, at + length), width / 2 + deep, (0.0, high)))
            begin = at + length
            low, up = sorted((side * (width / 2 + INTO), side * (width / 2 + deep + INTO)))
            found.append((at - INTO, low, 0.0, at + length + INTO, up, high + INTO))
        rows.append(_beside(side, (begin, LONG), width / 2, (0.0, height)))
    return Place(Scene(boxes=rows), (), np.array(found), wanted=3)


def posts(rng):
    """Return two facades with twelve posts before them, of one radius."""
    rows, radius = _facades(rng), rng.uniform(0.08, 0.3)
    side, way = np.repeat([-1, 1], 6), rng.uniform(-25, 25, 12)
    y = side * (abs(rows[1][1]) - THICK - rng.uniform(1.5, 3.0, 12))
    cylinders = [(x, at, -0.4, rng.uniform(3, 6), radius) for x, at in zip(way, y, strict=True)]
    off = radius + INTO
    found = np.c_[way - off, y - off, np.full(12, INTO), way + off, y + off, np.full(12, 6.0)]
    return Place(Scene(boxes=rows, cylinders=cylinders), (), found, wanted=8)


def town(rng):
    """Return a street with houses of several fronts, posts and parked boxes."""
    rows, cylinders = [_ground()], []
    for side in (-1, 1):
        x = -60.0
        while x < 60.0:
            wide, back = rng.uniform(6, 14), rng.uniform(6, 10)
            rows.append(_beside(side, (x, x + wide), back, (0, rng.uniform(5, 12)), 8.0))
            x += wide + (rng.uniform(2, 5) if rng.random() < 0.4 else 0.0)
        for x in rng.uniform(-50, 50, 6):
            rows.append(box((x, side * 4.5 - 0.9, 0), (x + 4.2, side * 4.5 + 0.9, 1.5)))
        cylinders += [(x, side * 5.6, 0, 6, 0.1) for x in rng.uniform(-50, 50, 5)]
    return Place(Scene(boxes=rows, cylinders=cylinders))


def _of_simulator(build):
    def place(rng):
        return Place(build(rng))

    place.__name__ = build.__name__
    return place


BARE = (bare_tunnel, two_facades, wall_and_plane, open_plane)
HELD = (niches, posts)
ORDINARY = (town, *map(_of_simulator, (street, forest, room)))


def _ground():
    return box((-LONG, -LONG, -1.0), (LONG, LONG, 0.0))


def _facades(rng):
    """Return the ground, the right facade and the left one."""
    high = rng.uniform(6, 15)
    right, left = (_beside(s, (-LONG, LONG), rng.uniform(6, 11), (0.0, high)) for s in (-1, 1))
    return [_ground(), right, left]


def _beside(side, x, y, z, thick=THICK):
    """Return a box to one side of the way, its face y from it."""
    low, high = sorted((side * y, side * (y + thick)))
    return box((x[0], low, z[0]), (x[1], high, z[1]))


def _round(width):
    """Return triangles of a horse-shoe profile: a round vault on a level floor."""
    angle = np.linspace(-0.2 * np.pi, 1.2 * np.pi, FACETS + 1)
    radius = width / 2
    profile = np.c_[radius * np.cos(angle), radius * np.sin(angle)]
    profile = np.vstack([profile, profile[:1]])
    profile[:, 1] -= profile[:, 1].min()
    ends = [np.c_[np.full(len(profile), x), profile] for x in (-LONG, LONG)]
    return mesh(np.stack(ends, axis=1))
