"""A town of several kilometres in cells of one block each, made where they are looked at."""

from collections import OrderedDict

import numpy as np

from idem_ros.simulation.furniture import bush, car, house, lamp_post, sign, street_box, tree
from idem_ros.simulation.street import KERB, KERB_HEIGHT, PAVEMENT
from idem_ros.simulation.surfaces import Scene, merged, mesh, placed

BLOCK = 90.0  # [m] from the middle of a street to that of the next
FRONT = KERB + PAVEMENT[1]  # [m] from the middle of a street to the fronts
CORNER = 14.0  # [m] from the middle of a crossing that stay free of cars
DEEP = 10.0  # [m] that a row of houses takes
TURN = 8.0  # [m] radius of a drive at a crossing
STEP = 0.5  # [m] between points of a route
CELLS_KEPT = 64
PARK = 0.12  # of the blocks
DIRECTIONS = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
SIDES = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.5), (1.0, 1.0, 1.0), (0.0, 1.0, 1.5))  # corner, turn / pi


class Town:
    """A square town: streets in a grid, a block of houses or a park in each cell.

    A cell is made when it is looked at, from the seed and its place alone, and forgotten again:
    however large the town, a few dozen of them are in memory.

    Args:
        seed: from 0; the same one gives the same town.
        blocks: along each side, from 3.
    """

    def __init__(self, seed, blocks):
        self.blocks = blocks
        self._seed = seed
        self._cells = OrderedDict()
        rng = np.random.default_rng(seed)
        turn, length = rng.uniform(0.0, 2 * np.pi, 6), rng.uniform(300.0, 900.0, 6)
        number = 2 * np.pi / length
        self._waves = number * np.cos(turn), number * np.sin(turn), turn[::-1], 0.0015 * length

    @property
    def extent(self):
        """The length of a side [m]; one corner of the town is at x = y = 0."""
        return self.blocks * BLOCK

    def height(self, x, y):
        """Return the height [m] of the streets at x and y, of any shape."""
        kx, ky, phase, tall = self._waves
        x, y = np.asarray(x)[..., None], np.asarray(y)[..., None]
        return (tall * np.sin(kx * x + ky * y + phase)).sum(axis=-1)

    def near(self, place, reach):
        """Return the `Scene` of all cells within reach [m] of a place (x, y, ...)."""
        low, high = (
            np.clip(np.floor((np.asarray(place[:2]) + side * reach) / BLOCK), 0, self.blocks - 1)
            for side in (-1, 1)
        )
        columns, rows = (range(int(a), int(b) + 1) for a, b in zip(low, high, strict=True))
        return merged(self._cell(i, j) for j in rows for i in columns)

    def street(self, i, j, along_x):
        """Return the route (m, 3) along one side of cell (i, j): its lower or its left one."""
        s = np.arange(0.0, BLOCK, STEP)
        xy = np.array([i, j]) * BLOCK + s[:, None] * DIRECTIONS[0 if along_x else 1]
        return np.column_stack([xy, self.height(*xy.T)])

    def route(self, length, rng):
        """Return the (m, 3) middle of the streets of a drive of some length [m], turning at will.

        It begins in the middle of the town.
        """
        cell, heading = np.array([self.blocks // 2] * 2), int(rng.integers(4))
        corners = [cell]
        while len(corners) < 3 or (len(corners) - 1) * BLOCK < length + TURN:
            heading = self._turned(cell, heading, rng)
            cell = cell + DIRECTIONS[heading]
            corners.append(cell)
        xy = street_corners(np.array(corners) * BLOCK)[: int(length / STEP) + 2]
        return np.column_stack([xy, self.height(*xy.T)])

    def _turned(self, cell, heading, rng):
        """Return where a drive heads from a crossing, in quarter turns; not to the edge."""
        for turn in rng.permutation([0, 0, 1, -1]):
            there = cell + DIRECTIONS[(heading + turn) % 4]
            if (there > 0).all() and (there < self.blocks).all():
                return int(heading + turn) % 4
        raise AssertionError(
            'from every crossing within a town of three blocks two streets lead on'
        )

    def _cell(self, i, j):
        if (i, j) not in self._cells:
            self._cells[i, j] = self._made(i, j, np.random.default_rng([self._seed, i, j]))
        self._cells.move_to_end((i, j))
        if len(self._cells) > CELLS_KEPT:
            self._cells.popitem(last=False)
        return self._cells[i, j]

    def _made(self, i, j, rng):
        corner = np.array([i, j]) * BLOCK
        parts = [Scene(triangles=mesh(self._ground(corner, rng)))]
        is_park = rng.random() < PARK
        for x, y, turn in SIDES:
            side = _Side(self, corner + (x * BLOCK, y * BLOCK), turn * np.pi)
            parts += side.pavement(rng)
            parts += side.cars(rng)
            parts += [] if is_park else side.houses(rng)
        parts += self._yard(corner, rng, 40 if is_park else 6)
        return merged(parts)

    def _ground(self, corner, rng):
        """The vertices of a cell: half of each street around it, kerbs, and what they enclose."""
        edge = KERB + 1e-3
        near = np.array([0.0, 2.6, KERB, edge, FRONT, 14.0, 25.0, 35.0])
        line = np.concatenate([near, [BLOCK / 2], BLOCK - near[::-1]])
        x, y = np.meshgrid(line, line, indexing='ij')
        inner = np.minimum(np.minimum(x, BLOCK - x), np.minimum(y, BLOCK - y))
        bumps = rng.normal(0.0, 0.015, x.shape)
        bumps[[2, -3]], bumps[:, [2, -3]] = bumps[[3, -4]], bumps[:, [3, -4]]
        bumps[inner == 0.0] = 0.0  # as the cell beside it has it
        x, y = x + corner[0], y + corner[1]
        raised = np.where(inner > KERB, KERB_HEIGHT, 0.0)
        return np.stack([x, y, self.height(x, y) + raised + bumps], axis=2)

    def _yard(self, corner, rng, count):
        """Trees and bushes behind the houses, or in a park."""
        for _ in range(count):
            x, y = corner + rng.uniform(FRONT + DEEP, BLOCK - FRONT - DEEP, 2)
            build = tree if rng.random() < 0.6 else bush
            z = float(self.height(x, y)) + KERB_HEIGHT
            yield placed(build(rng), float(x), float(y), z, rng.uniform(0.0, 2 * np.pi))


class _Side:
    """One side of a cell: s along its street, `offset` from the street's middle into the cell."""

    def __init__(self, town, corner, turn):
        self._town, self._corner, self._turn = town, corner, turn
        self._along = np.array([np.cos(turn), np.sin(turn)])
        self._inward = np.array([-np.sin(turn), np.cos(turn)])

    def pavement(self, rng):
        near, far = KERB + 0.5, FRONT - 0.45
        rows = (
            (tree, 17.0, near + 0.3),
            (lamp_post, 27.0, near),
            (sign, 23.0, near),
            (street_box, 11.0, far),
            (bush, 26.0, far),
        )
        for build, spacing, offset in rows:
            for s in np.arange(FRONT + rng.uniform(0.5, spacing), BLOCK - FRONT, spacing):
                yield self._placed(build(rng), s, offset + rng.uniform(-0.15, 0.15), rng)

    def cars(self, rng):
        s = CORNER + rng.uniform(0.0, 6.0)
        while s < BLOCK - CORNER:
            if rng.random() < 0.6:
                yield self._placed(car(rng), s, KERB - 1.05 - rng.uniform(0, 0.15), rng, 0.0)
            s += rng.uniform(5.4, 7.2)

    def houses(self, rng):
        s = FRONT + rng.uniform(0.0, 2.0)
        last = BLOCK - FRONT - DEEP  # what is left there is of the next side's first house
        while s < last - 7.0:
            if rng.random() < 0.25:
                s += rng.uniform(3.5, 7.5)
            width, storeys = min(rng.uniform(7.5, 13.5), last - s), int(rng.integers(2, 6))
            if width < 5.0:
                return
            setback = FRONT + max(0.0, rng.normal(0.4, 0.5))
            yield self._front(house(rng, width, storeys), s, width, setback)
            s += width + rng.choice([0.0, 0.1, 1.2])

    def _front(self, part, s, width, offset):
        x, y = self._corner + s * self._along + offset * self._inward
        middle = self._corner + (s + width / 2) * self._along + offset * self._inward
        z = float(self._town.height(*middle)) + KERB_HEIGHT
        return placed(part, float(x), float(y), z, self._turn)

    def _placed(self, part, s, offset, rng, raised=KERB_HEIGHT):
        x, y = self._corner + s * self._along + offset * self._inward
        z = float(self._town.height(x, y)) + raised
        return placed(part, float(x), float(y), z, self._turn + rng.normal(0.0, 0.03))


def street_corners(corners, radius=TURN):
    """Return points, STEP apart, of the (k, 2) corners of a line, with arcs where it turns."""
    pieces = [corners[:1]]
    quarter = np.linspace(0.0, np.pi / 2, 24)[:, None]
    for before, at, after in zip(corners, corners[1:], corners[2:], strict=False):
        came, goes = (at - before) / BLOCK, (after - at) / BLOCK
        center = at + radius * (goes - came)
        is_straight = (came == goes).all()
        arc = center - radius * (np.cos(quarter) * goes - np.sin(quarter) * came)
        pieces.append(at[None] if is_straight else arc)
    line = np.concatenate([*pieces, corners[-1:]])
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    stops = np.arange(0.0, length[-1], STEP)
    return np.column_stack([np.interp(stops, length, line[:, axis]) for axis in (0, 1)])
