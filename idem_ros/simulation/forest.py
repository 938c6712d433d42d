"""A wood on uneven ground, and the path that winds through it."""

import numpy as np

from idem_ros.simulation.furniture import BURIED, bush
from idem_ros.simulation.surfaces import Floor, Scene, box, curve, merged, mesh, placed

HALF = 35.0  # [m]: the wood is a square of twice this
EDGE = 5.0  # [m] of bare ground about it
GRID = 2.5  # [m] between vertices of the ground
CLEAR = 1.2  # [m] to either side of the path
STEM = 0.8  # [m]: half the least distance of two trees


def forest(rng):
    """Return a wood of 70 m by 70 m with a path of some 40 m; z = 0 is its mean height."""
    waves = _waves(rng)
    y = rng.uniform(-6.0, 6.0, 5)
    path = curve(np.column_stack([np.linspace(-20.0, 20.0, 5), y]))
    floor = Floor((-HALF, -HALF), (HALF, HALF), path, CLEAR)
    parts = [Scene(triangles=mesh(_ground(waves, rng)))]
    kinds = ((_fallen, 8, 1.6), (_tree, 160, STEM), (_sapling, 40, 0.5), (bush, 30, 0.6))
    for build, count, radius in (*kinds, (_stone, 30, 0.4)):
        for _ in range(count):
            place = floor.take(rng, radius)
            if place is not None:
                turn = rng.uniform(0.0, 2 * np.pi)
                parts.append(placed(build(rng), *place, float(_height(waves, *place)), turn))
    whole = merged(parts, route=np.column_stack([path, _height(waves, *path.T)]))
    return placed(whole, 0.0, 0.0, yaw=rng.uniform(0.0, 2 * np.pi))


def _waves(rng):
    """Return (8, 4): wave vector x y [rad/m], phase, amplitude [m] of the waves of the ground."""
    direction, length = rng.uniform(0.0, 2 * np.pi, 8), rng.uniform(9.0, 45.0, 8)
    number = 2 * np.pi / length
    vector = number * np.cos(direction), number * np.sin(direction)
    return np.column_stack([*vector, rng.uniform(0.0, 2 * np.pi, 8), 0.009 * length])


def _height(waves, x, y):
    kx, ky, phase, amplitude = waves.T
    x, y = np.asarray(x)[..., None], np.asarray(y)[..., None]
    return (amplitude * np.sin(kx * x + ky * y + phase)).sum(axis=-1)


def _ground(waves, rng):
    """The vertices of the ground, which its roughness moves up and down."""
    line = np.arange(-HALF - EDGE, HALF + EDGE + GRID / 2, GRID)
    x, y = np.meshgrid(line, line, indexing='ij')
    return np.stack([x, y, _height(waves, x, y) + rng.normal(0.0, 0.06, x.shape)], axis=2)


def _tree(rng):
    """A tall trunk, thick or thin, and a crown of spheres about its upper half."""
    tall, radius = rng.uniform(7.0, 14.0), rng.uniform(0.07, 0.34)
    up = rng.uniform(rng.uniform(0.25, 0.55), 1.0, 9)
    aside = rng.normal(0.0, 0.1 * tall, (9, 2)) * (1.15 - up)[:, None]
    size = tall * rng.uniform(0.04, 0.1, 9)
    crown = np.column_stack([aside, up * tall, size])
    return Scene(cylinders=[(0.0, 0.0, -BURIED, tall, radius)], spheres=crown)


def _sapling(rng):
    """A young tree, with leaves at the height of a sensor."""
    tall = rng.uniform(1.5, 3.5)
    centers = rng.normal(0.0, 0.2, (6, 3)) + (0.0, 0.0, 0.75 * tall)
    leaves = np.column_stack([centers, rng.uniform(0.1, 0.3, 6)])
    return Scene(cylinders=[(0.0, 0.0, -BURIED, tall, rng.uniform(0.02, 0.05))], spheres=leaves)


def _fallen(rng):
    """A squared trunk that lies on the ground, with the stump it broke off."""
    half, thick = rng.uniform(1.2, 3.0), rng.uniform(0.25, 0.5)
    trunk = box((-half, -thick / 2, -0.3), (half, thick / 2, thick - 0.05))
    stump = (half + 0.5, 0.0, -BURIED, rng.uniform(0.3, 0.9), 0.6 * thick)
    return Scene(boxes=[trunk], cylinders=[stump])


def _stone(rng):
    """A boulder, round or edged, half in the ground."""
    size = rng.uniform(0.2, 0.6)
    if rng.random() < 0.5:
        return Scene(spheres=[(0.0, 0.0, 0.1 * size, size)])
    low = -size * rng.uniform(0.6, 1.0, 3)
    return Scene(boxes=[box(low, -low * (1.0, 1.0, 0.7))])
