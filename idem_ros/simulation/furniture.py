"""What stands in rooms, each in its own frame: on z = 0, or with its back against y = 0."""

import numpy as np

from idem_ros.simulation.scene import Scene, box, merged, placed


def table(rng):
    """Return a table with things on it and chairs about it; within 1.4 m of its middle."""
    x, y, top = rng.uniform(0.6, 0.9), rng.uniform(0.35, 0.45), rng.uniform(0.71, 0.77)
    rows = [box((-x, -y, top - 0.04), (x, y, top))]
    for i in (-1, 1):
        for j in (-1, 1):
            foot = np.array([i * (x - 0.06), j * (y - 0.06), 0.0])
            rows.append(box(foot - (0.03, 0.03, 0.0), foot + (0.03, 0.03, top - 0.04)))
    for along in rng.uniform(-0.8, 0.8, rng.integers(1, 4)) * x:
        half, tall = rng.uniform(0.06, 0.25), rng.uniform(0.1, 0.45)
        row = box((along - half, -0.12, top), (along + half, 0.12, top + tall), rng.uniform(0, 3))
        rows.append(row)
    chairs = []
    for side in (-1, 1):
        for along in (-0.5, 0.5):
            if rng.random() < 0.7:
                turn = rng.normal(0.0, 0.4) + (np.pi if side > 0 else 0.0)
                aside = side * (y + rng.uniform(0.1, 0.35))
                chairs.append(placed(chair(), along * x, aside, yaw=turn))
    return merged([Scene(boxes=rows), *chairs])


def chair():
    """Return a chair that faces +y."""
    rows = [box((-0.22, -0.22, 0.42), (0.22, 0.22, 0.47))]
    rows.append(box((-0.22, -0.24, 0.47), (0.22, -0.2, 0.95)))
    legs = [(x, y, 0.0, 0.42, 0.02) for x in (-0.19, 0.19) for y in (-0.19, 0.19)]
    return Scene(boxes=rows, cylinders=legs)


def cartons(rng):
    """Return a few cartons, one upon the other, none quite straight; within 0.6 m."""
    rows, low = [], 0.0
    for _ in range(int(rng.integers(1, 4))):
        x, y, z = rng.uniform((0.2, 0.15, 0.2), (0.4, 0.35, 0.55))
        rows.append(box((-x, -y, low), (x, y, low + z), rng.normal(0.0, 0.3)))
        low += z
    return Scene(boxes=rows)


def plant(rng):
    """Return a plant in a pot, up to 2 m high; within 0.6 m."""
    pot, stem = rng.uniform(0.3, 0.5), rng.uniform(0.9, 1.4)
    centers = rng.normal(0.0, 0.16, (9, 3)) + (0.0, 0.0, stem)
    cylinders = [(0.0, 0.0, 0.0, pot, rng.uniform(0.14, 0.22)), (0.0, 0.0, pot, stem, 0.025)]
    spheres = np.column_stack([centers, rng.uniform(0.06, 0.15, 9)])
    return Scene(cylinders=cylinders, spheres=spheres)


def pillar(rng, height):
    """Return a round or a square pillar; within 0.4 m."""
    half = rng.uniform(0.14, 0.26)
    if rng.random() < 0.5:
        return Scene(cylinders=[(0.0, 0.0, 0.0, height, half)])
    return Scene(boxes=[box((-half, -half, 0.0), (half, half, height))])


def shelf(rng, width):
    """Return an open shelf with books, x from 0 to `width`, its back at y = 0, it towards -y."""
    deep, tall, boards = rng.uniform(0.28, 0.42), rng.uniform(1.5, 2.3), int(rng.integers(4, 7))
    rows = [box((0.0, -0.02, 0.0), (width, 0.0, tall))]
    rows += [box((x, -deep, 0.0), (x + 0.03, 0.0, tall)) for x in (0.0, width - 0.03)]
    step = (tall - 0.03) / (boards - 1)
    for k in range(boards):
        rows.append(box((0.0, -deep, k * step), (width, 0.0, k * step + 0.03)))
    for k in range(boards - 1):
        left, right = np.sort(rng.uniform(0.03, width - 0.03, 2))
        books = (right, -0.02, k * step + step * rng.uniform(0.5, 0.9))
        rows.append(box((left, -deep * rng.uniform(0.5, 0.95), k * step), books))
    return Scene(boxes=rows)


def cupboard(rng, width):
    """Return a closed cupboard, x from 0 to `width`, its back at y = 0, it towards -y."""
    deep, tall = rng.uniform(0.4, 0.65), rng.uniform(0.8, 2.1)
    rows = [box((0.0, -deep, 0.0), (width, 0.0, tall))]
    left = rng.uniform(0.0, 0.6) * width
    things = (left + 0.3 * width, -0.1, tall + rng.uniform(0.1, 0.3))
    return Scene(boxes=[*rows, box((left, 0.1 - deep, tall), things)])


def radiator(rng, width):
    """Return a radiator below a window, x from 0 to `width`, a little off the wall at y = 0."""
    return Scene(boxes=[box((0.0, -0.15, 0.12), (width, -0.05, rng.uniform(0.6, 0.8)))])
