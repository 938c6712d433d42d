"""How well scans agree in a map, without truth: joint minus own entropy where they meet.

In each cell of a lattice that two scans or more have points in, their joint distribution is the
mean of their own, each counting once, however many points it has. Both are looked at along the
normal of the scans' own surfaces, in cells where these are flat: along a surface points lie as
the sensor's pattern has it, across it they spread by noise and by how far poses are off.

With w the mean of the scans' own variances along the normal, and b that of their means less what
w alone makes of it, the difference of the entropies is q = 1/2 ln((w + b) / w): 0 where all agree.
"""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Indices, Integers, Mask, Points, Weights
from idem_ros.core.geometry.grid import CELL_MARGIN, build_grid
from idem_ros.core.metric.moments import TIE, moments_around

LEAST = 5.0  # points of a scan in a cell, that tell its own variance
FLAT = 25.0  # times its variance across a surface has along it, in both directions
LEAST_SPREAD = 0.04  # of a cell's edge: what is thinner is as good as flat
LOWEST = -0.9  # of b in w: of few points both are guesses


class MapRows(NamedTuple):
    """Voxels of scans where poses put them."""

    mean: Points  # (N, 3)
    weights: Weights  # (N, 7): points, and their scatter about the mean
    scan: Integers  # (N,): which scan each is of


class Consistency(NamedTuple):
    """Sums over cells, that add up over the parts of a map."""

    q: float = 0.0  # of q of the cells that scans meet in [nat]
    cells: int = 0
    q_met: float = 0.0  # of those that passes meet in, long after one another
    cells_met: int = 0
    entropy: float = 0.0  # of the entropies of balls around points, Eq. 4 without its 1 [nat]
    points: float = 0.0

    def plus(self, other: 'Consistency') -> 'Consistency':
        """Return that of two parts together."""
        return Consistency(
            self.q + other.q,
            self.cells + other.cells,
            self.q_met + other.q_met,
            self.cells_met + other.cells_met,
            self.entropy + other.entropy,
            self.points + other.points,
        )

    @property
    def score(self) -> float | None:
        """Mean q of the cells that scans meet in [nat]; 0 is best; None: nothing meets."""
        return self.q / self.cells if self.cells else None

    @property
    def score_met(self) -> float | None:
        """Likewise of those that passes meet in."""
        return self.q_met / self.cells_met if self.cells_met else None

    @property
    def mean_map_entropy(self) -> float | None:
        """Mean entropy of balls around points [nat]; it falls with noise and with density."""
        return self.entropy / self.points if self.points else None


def consistency_of(rows: MapRows, along: Floats, edge: float, gap: float) -> Consistency:
    """Return the `Consistency` of cells, without the mean map entropy.

    Args:
        rows: `MapRows`; none is told twice.
        along: (S,) how far along its way the sensor was at each scan.
        edge: of the cells, in the clouds' unit.
        gap: along the way, from which on a scan is of another pass than that before it.
    """
    scans, (cell, scan) = _by_cell_and_scan(rows, edge)
    tells = scans[0] >= LEAST
    n, mean, covariance = (of_each[tells] for of_each in scans)
    cell, scan = cell[tells], scan[tells]
    begin, count = _runs(cell)
    if not (count > 1).any():
        return Consistency()
    q, is_flat = _differences((n, mean, covariance), begin, count, LEAST_SPREAD * edge)
    counts = (count > 1) & is_flat
    q = q[counts]
    is_far = np.r_[False, np.diff(along[scan]) > gap]
    is_far[begin] = False
    met = (np.add.reduceat(is_far, begin) > 0)[counts]
    return Consistency(float(q.sum()), len(q), float(q[met].sum()), int(met.sum()))


def entropy_of(points: Points, weights: Weights, inside: Mask, radius: float) -> Consistency:
    """Return the sums of the mean map entropy, over voxels that count as many points as they are.

    Args:
        points: (N, 3) means of the map's voxels.
        weights: (N, 7) points and their scatter.
        inside: (N,) which are centres; the others are members of balls only.
        radius: of the balls.
    """
    grid, order = build_grid(points, radius * CELL_MARGIN)
    unit, own = np.empty((2, len(points), 10))
    ordered = np.ascontiguousarray(weights[order])
    moments_around(grid.points, grid, ordered, radius * radius * TIE, unit, own)
    _, covariance = _normalised(own)
    det = np.linalg.det(2.0 * np.pi * np.e * covariance)
    counted = inside[order] & (own[:, 0] >= LEAST) & (det > 0.0)
    h, each = 0.5 * np.log(det[counted]), ordered[counted, 0]
    return Consistency(entropy=float(h @ each), points=float(each.sum()))


def merged(rows: MapRows, edge: float) -> tuple[Points, Weights]:
    """Return the means (M, 3) and weights (M, 7) of the cells that rows lie in, of all scans."""
    sums, _, cell = _summed(rows, edge, np.zeros(len(rows.scan), np.int64))
    mean, covariance = _normalised(sums)
    upper = covariance[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]] * sums[:, :1]
    return mean + (cell + 0.5) * edge, np.column_stack([sums[:, 0], upper])


def _by_cell_and_scan(
    rows: MapRows, edge: float
) -> tuple[tuple[Floats, Points, Floats], tuple[Integers, Integers]]:
    """Return (points, mean, covariance) and (cell's number, scan) of each scan in each cell."""
    sums, scan, cell = _summed(rows, edge, rows.scan)
    n = sums[:, 0]
    mean, covariance = _normalised(sums)
    covariance *= (n / np.maximum(n - 1.0, 1.0))[:, None, None]
    changed = np.r_[True, (np.diff(cell, axis=0) != 0).any(axis=1)]
    return (n, mean, covariance), (np.cumsum(changed) - 1, scan)


def _summed(rows: MapRows, edge: float, part: Integers) -> tuple[Floats, Integers, Integers]:
    """Return moments (M, 10) about cells' middles of each part of each cell, part and cell."""
    cell = np.floor(rows.mean / edge).astype(np.int64)
    order = np.lexsort((part, cell[:, 2], cell[:, 1], cell[:, 0]))
    key = np.column_stack([cell, part])[order]
    begin = np.flatnonzero(np.r_[True, (np.diff(key, axis=0) != 0).any(axis=1)])
    d = (rows.mean - (cell + 0.5) * edge)[order]
    weights = rows.weights[order]
    w = weights[:, :1]
    squares = w * d[:, [0, 0, 0, 1, 1, 2]] * d[:, [0, 1, 2, 1, 2, 2]] + weights[:, 1:]
    sums = np.add.reduceat(np.column_stack([w, w * d, squares]), begin)
    return sums, key[begin, 3], key[begin, :3]


def _normalised(moments: Floats) -> tuple[Points, Floats]:
    """Return mean and covariance (N, 3, 3), divided by the number, of moments (N, 10)."""
    n = moments[:, :1]
    mean = moments[:, 1:4] / n
    whole = (moments[:, 4:] / n)[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
    return mean, whole - mean[:, :, None] * mean[:, None, :]


def _runs(numbers: Integers) -> tuple[Indices, Integers]:
    """Return where runs of the same number begin, and how long they are."""
    begin = np.flatnonzero(np.r_[True, np.diff(numbers) != 0][: len(numbers)])
    return begin, np.diff(np.r_[begin, len(numbers)])


def _differences(
    scans: tuple[Floats, Points, Floats], begin: Indices, count: Integers, least: float
) -> tuple[Floats, Mask]:
    """Return q of each run of scans' points, means and covariances, and whether it is flat."""
    n, mean, covariance = scans
    of = np.repeat(np.arange(len(begin)), count)
    own = np.add.reduceat(covariance, begin) / count[:, None, None]
    variances, axes = np.linalg.eigh(own)
    normal = axes[of, :, 0]
    along = np.einsum('ri,rij,rj->r', normal, covariance, normal)
    w = np.add.reduceat(along, begin) / count
    by_chance = np.add.reduceat(along / n, begin) / count
    place = np.einsum('ri,ri->r', mean, normal)
    middle = np.add.reduceat(place, begin) / count
    far = np.add.reduceat((place - middle[of]) ** 2, begin)
    b = far / np.maximum(count - 1, 1) - by_chance
    ratio = np.maximum(b / (w + least * least), LOWEST)
    return 0.5 * np.log1p(ratio), variances[:, 1] > FLAT * np.maximum(variances[:, 0], 0.0)
