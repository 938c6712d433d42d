"""The things that stand in scenes and rooms, each in its own frame: x along, z up."""

import numpy as np

from idem_ros.simulation.surfaces import Scene, box, merged, placed

STOREY = 3.0
BURIED = 0.4  # [m]: feet reach below the ground, whose relief then leaves no gap under them


def car(rng):
    """Return a parked car, sometimes a van: body, cabin and wheels as boxes, x forward."""
    if rng.random() < 0.2:
        length, width, waist, roof, cabin = 5.2, 1.95, 1.1, 2.2, (-0.5, 0.36)
    else:
        length, width, waist, roof, cabin = 4.3, 1.75, 0.9, 1.46, (-0.38, 0.2)
    length, width, roof = length * rng.uniform(0.92, 1.06), width, roof * rng.uniform(0.95, 1.08)
    side, end = width / 2, length / 2
    rows = [
        box((-end, -side, 0.25), (end, side, waist)),
        box((cabin[0] * length, 0.1 - side, waist), (cabin[1] * length, side - 0.1, roof)),
    ]
    for x in (-0.31 * length, 0.31 * length):
        for y in (-side + 0.1, side - 0.1):
            rows.append(box((x - 0.3, y - 0.11, -BURIED), (x + 0.3, y + 0.11, 0.3)))
    return Scene(boxes=rows)


def tree(rng, trunk_m=2.6, crown_m=1.8, blobs=14):
    """Return a tree: an upright trunk, and a crown of spheres around its upper end."""
    trunk = (0.0, 0.0, -BURIED, trunk_m + 0.7 * crown_m, rng.uniform(0.1, 0.24))
    direction = rng.normal(size=(blobs, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    radius = crown_m * rng.uniform(0.18, 0.42, blobs)
    offset = direction * (crown_m * rng.uniform(0.35, 0.85, blobs))[:, None]
    centers = offset * (1.0, 1.0, 1.15) + (0.0, 0.0, trunk_m + crown_m)
    return Scene(cylinders=[trunk], spheres=np.column_stack([centers, radius]))


def bush(rng, size_m=0.8, blobs=6):
    """Return a bush: a heap of spheres on the ground."""
    centers = rng.normal(0.0, 0.5 * size_m, (blobs, 3)) * (1.0, 1.0, 0.4)
    centers[:, 2] = np.abs(centers[:, 2]) + 0.2 * size_m
    return Scene(spheres=np.column_stack([centers, size_m * rng.uniform(0.3, 0.6, blobs)]))


def lamp_post(rng):
    """Return a street lamp: foot, shaft and an arm along y."""
    height = rng.uniform(5.0, 7.0)
    shaft = (0.0, 0.0, -BURIED, height, rng.uniform(0.06, 0.09))
    arm = box((-0.1, -1.4, height - 0.15), (0.1, 0.1, height))
    return Scene(cylinders=[(0.0, 0.0, -BURIED, 0.9, 0.13), shaft], boxes=[arm])


def sign(rng):
    """Return a traffic sign: a thin pole with a panel that faces along x."""
    height, width = rng.uniform(2.3, 2.9), rng.uniform(0.25, 0.4)
    panel = box((-0.05, -width, height - 2 * width), (-0.035, width, height))
    return Scene(cylinders=[(0.0, 0.0, -BURIED, height, 0.035)], boxes=[panel])


def street_box(rng):
    """Return what stands on pavements: a bin, a bench, a power cabinet or a bollard."""
    kind = rng.integers(4)
    if kind == 0:
        return Scene(cylinders=[(0.0, 0.0, -BURIED, rng.uniform(0.8, 1.1), 0.25)])
    if kind == 1:
        seat = box((-0.8, -0.22, 0.38), (0.8, 0.22, 0.46))
        back = box((-0.8, 0.18, 0.46), (0.8, 0.22, 0.85))
        feet = [box((x - 0.05, -0.2, -BURIED), (x + 0.05, 0.2, 0.38)) for x in (-0.6, 0.6)]
        return Scene(boxes=[seat, back, *feet])
    if kind == 2:
        return Scene(boxes=[box((-0.4, -0.2, -BURIED), (0.4, 0.2, rng.uniform(1.0, 1.4)))])
    return Scene(cylinders=[(0.0, 0.0, -BURIED, 0.9, 0.08)])


def house(rng, width, storeys, depth=9.0):
    """Return a terraced house: its front along x from 0 to `width`, the house towards +y.

    The glass lies `recess` behind the front; piers and bands between the windows stand out to it.
    """
    recess, height = rng.uniform(0.12, 0.32), STOREY * storeys + rng.uniform(0.3, 0.9)
    columns = max(2, round(width / rng.uniform(2.0, 2.9)))
    door, step = int(rng.integers(columns)), width / columns
    pier = step * rng.uniform(0.17, 0.28)
    rows = [
        box((0.0, recess, -BURIED), (width, depth, height)),
        box((-0.05, -rng.uniform(0.15, 0.4), height - 0.35), (width + 0.05, recess, height)),
        box((door * step, -0.45, -BURIED), ((door + 1) * step, recess, rng.uniform(0.12, 0.3))),
    ]
    for k in range(columns + 1):
        left, right = max(0.0, k * step - pier), min(width, k * step + pier)
        rows.append(box((left, 0.0, -BURIED), (right, recess, height)))
    for sill in ((0.0, door * step), ((door + 1) * step, width)):
        rows.append(box((sill[0], 0.0, -BURIED), (sill[1], recess, 0.9)))
    for floor in range(1, storeys):
        low = STOREY * floor
        rows.append(box((0.0, 0.0, low - 0.55), (width, recess, low + rng.uniform(0.6, 0.9))))
    return Scene(boxes=rows + _front_extras(rng, width, columns, step, storeys))


def _front_extras(rng, width, columns, step, storeys):
    """Balconies or a bay window before a front, a rain pipe at its end."""
    rows = [box((width - 0.16, -0.12, -BURIED), (width - 0.04, -0.02, STOREY * storeys))]
    if rng.random() < 0.45:
        left = step * int(rng.integers(columns - 1)) + 0.2
        reach = rng.uniform(0.7, 1.1)
        for floor in range(1, storeys):
            low = STOREY * floor
            rows.append(box((left, -reach, low - 0.15), (left + step + 0.8, 0.0, low)))
            rows.append(box((left, -reach, low), (left + step + 0.8, 0.06 - reach, low + 0.95)))
    elif rng.random() < 0.5:
        left = step * int(rng.integers(columns))
        low, high = rng.uniform(0.5, 0.8), STOREY * (storeys - 1) + 2.4
        rows.append(box((left + 0.2, -rng.uniform(0.4, 0.8), low), (left + step - 0.2, 0.0, high)))
    return rows


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
