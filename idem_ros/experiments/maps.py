"""q_tot and RMSE over two displacements of the source, and where they are least."""

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import KDTree

from idem_ros.core.metric.landscape import Landscape, displaced, offsets_on_grid, q_on_grid
from idem_ros.core.metric.region_of_interest import GridRegion, region_on_grid
from idem_ros.experiments.distances import STEEPEST, CloudDistances, Distances, nearest

MAP_HEADER = ('panel', 'axis_1', 'axis_2', 'offset_1', 'offset_2', 'value', 'inside_roi')
SAME = 1e-6  # [the case's unit]: how far apart two points count as one
BATCH = 200  # rotations whose points are looked up at once
COARSEST = 27  # steps between the first places; a power of three
NINE = np.array(list(product((0, -1, 1), repeat=2)))  # the middle first: it wins a draw
ROUNDED = 1e-9  # [the clouds' unit]: by how much equal values may differ


@dataclass(frozen=True, eq=False)
class Map:
    """Values over the offsets of the source along or around two axes.

    Attributes:
        title: which clouds, in which order.
        label: of the colour bar, with the unit.
        axes: two names of `idem_ros.core.metric.landscape.AXES`; the rows' first.
        coordinates: (m,) and (n,) offsets [unit]; 0 is perfect alignment.
        values: (m, n).
        unit: of the offsets: 'mm', 'm' or 'deg'.
        region: `GridRegion` of q_tot; None for a distance.
    """

    title: str
    label: str
    axes: tuple
    coordinates: tuple
    values: np.ndarray
    unit: str
    region: GridRegion | None = None

    @property
    def minimum(self):
        """The offsets (u, v) of the least value: of equal ones, that nearest to the alignment."""
        first, second = np.meshgrid(*self.coordinates, indexing='ij')
        far = np.hypot(first, second)
        least = self.values <= self.values.min() + 1e-9 * np.ptp(self.values)
        at = np.unravel_index(np.argmin(np.where(least, far, np.inf)), far.shape)
        return float(first[at]), float(second[at])

    @property
    def error(self):
        """How far the minimum lies from perfect alignment [unit]."""
        return float(np.hypot(*self.minimum))

    def rows(self, panel):
        """Return rows under `MAP_HEADER`, one for each point of the grid."""
        inside = np.full(self.values.shape, '') if self.region is None else self.region.inside * 1
        mesh = np.meshgrid(*self.coordinates, indexing='ij')
        columns = (*mesh, self.values, inside)
        return [
            (panel, *self.axes, f'{u:.6g}', f'{v:.6g}', f'{value:.8g}', within)
            for u, v, value, within in zip(*(c.ravel().tolist() for c in columns), strict=True)
        ]


def symmetric_range(reach, step):
    """Return offsets from -reach to reach, with 0 among them."""
    return step * np.arange(-round(reach / step), round(reach / step) + 1)


def landscape_of(case, threads=1, radius=None):
    """Return the `Landscape` of a `Case` as the paper has it: lengths as given, a = 1."""
    return Landscape(case.target, case.source, radius, 'none', threads)


def count_in_common(case):
    """Return how many of the source's points are points of the target."""
    near, _ = KDTree(case.target).query(case.source, distance_upper_bound=SAME)
    return int(np.isfinite(near).sum())


def points_in_common(case):
    """Return a sentence that says how many of the source's points are points of the target."""
    count = count_in_common(case)
    return f"{count} of the source's {len(case.source)} points are points of the target, too."


def q_map(case, landscape, axes, offsets):
    """Return the `Map` of q_tot over two axes, both at the same offsets.

    Args:
        case: `Case` that names the clouds.
        landscape: of the same.
        axes: two names, both translations or both rotations (around the source's centroid).
        offsets: (n,) [the case's unit, or degrees].
    """
    in_radians = _in_own_unit(axes, offsets)
    values = q_on_grid(landscape, **dict.fromkeys(axes, in_radians))
    region = region_on_grid(values, offsets[1] - offsets[0])
    pair = case.name.replace('-', ' and ')
    return Map(pair, 'q_tot [nat]', axes, (offsets, offsets), values, unit_of(case, axes), region)


def rmse_maps(case, axes, offsets, threads=1):
    """Return two `Map`s of RMSE, target to source and back, as for `q_map`."""
    distances = CloudDistances(case.target, case.source, threads)
    shape, displacements = offsets_on_grid(**dict.fromkeys(axes, _in_own_unit(axes, offsets)))
    if axes[0].startswith('r'):
        both = _rmse_of_rotations(distances, displacements)
    else:
        both = distances.at(displacements[:, :3])[:2]
    one, other = case.name.split('-')
    titles = f'{one} → {other}', f'{other} → {one}'
    common = axes, (offsets, offsets)
    return tuple(
        Map(title, f'RMSE [{case.unit}]', *common, values.reshape(shape), unit_of(case, axes))
        for title, values in zip(titles, both, strict=True)
    )


def unit_of(case, axes):
    """Return the unit of offsets along or around axes."""
    return 'deg' if axes[0].startswith('r') else case.unit


def _in_own_unit(axes, offsets: np.ndarray):
    return np.deg2rad(offsets) if axes[0].startswith('r') else offsets


def _rmse_of_rotations(distances, displacements):
    """Return RMSE target to source and source to target, (K,) each, around the centroid.

    The definition of `CloudDistances`, for motions that it does not make.
    """
    target, source = distances.target, distances.source
    to_target, to_source = distances.trees
    motions = displaced(np.eye(4), displacements, source.mean(axis=0))
    found = []
    for begin in range(0, len(motions), BATCH):
        R, t = motions[begin : begin + BATCH, :3, :3], motions[begin : begin + BATCH, None, :3, 3]
        # Rows p: R^T (p - t) is (p - t) R.
        of_target = nearest(to_source, (target - t) @ R, distances.threads)
        moved = source @ R.transpose(0, 2, 1) + t
        of_source = nearest(to_target, moved, distances.threads)
        found.append([np.sqrt(np.mean(d**2, axis=1)) for d in (of_target, of_source)])
    return np.concatenate(found, axis=1)


def least_distances(case, distances, axes, offsets):
    """Return a `Map` of each of `Distances` that is exact wherever it may be least.

    Branch and bound: no distance falls faster than `STEEPEST`, so that a place rules out all
    about it that cannot come below what is known. `Map.minimum` is that of the whole grid;
    where nothing was looked at, the map holds the greatest value that was found.

    Args:
        case: `Case` that names the clouds.
        distances: `CloudDistances` of the same.
        axes: two names of translations.
        offsets: (n,) evenly spaced along both axes [the case's unit].
    """
    found = _searched(distances, axes, offsets)
    found = np.where(np.isnan(found), np.nanmax(found, axis=(1, 2))[:, None, None], found)
    label, unit = f'distance [{case.unit}]', unit_of(case, axes)
    return Distances(
        *(Map(case.name, label, axes, (offsets, offsets), values, unit) for values in found)
    )


def nearest_minima(distances, axes, offsets):
    """Return how far from the middle of the grid a descent from there ends, for `Distances`.

    Each step goes to the least of the eight neighbours, while it is lower.
    """
    known: dict = {}  # {place: (4,) values}, for the ways down begin alike
    return Distances(
        *(_descended(distances, number, axes, offsets, known) for number in range(len(STEEPEST)))
    )


def _searched(distances, axes, offsets):
    """Return (4, n, n) values; nan where no distance can be least."""
    last, stride = len(offsets) - 1, COARSEST
    found = np.full((len(STEEPEST), len(offsets), len(offsets)), np.nan)
    firsts = range(stride // 2, last + stride, stride)
    cells = np.array(list(product(firsts, firsts)))  # middles; each reaches stride // 2
    while True:
        # A middle beyond the edge stands for its cell from the edge: that is only nearer.
        at = tuple(np.clip(cells, 0, last).T)
        places = np.unique(np.stack(at, axis=1), axis=0)
        places = places[np.isnan(found[0][tuple(places.T)])]
        if len(places):
            found[(slice(None), *places.T)] = distances.at(_shifts(axes, offsets, places))
        if stride == 1:
            return found
        cells = cells[_may_hold_least(found, at, stride // 2 * (offsets[1] - offsets[0]))]
        stride //= 3
        cells = (cells[:, None] + stride * NINE).reshape(-1, 2)
        inside = (cells + stride // 2 >= 0) & (cells - stride // 2 <= last)
        cells = cells[inside.all(axis=1)]


def _may_hold_least(found, at, reach):
    """Return (K,) whether a value within `reach` of a place along both axes may be least."""
    fall = np.sqrt(2.0) * reach * np.array(STEEPEST)[:, None]
    least = np.nanmin(found, axis=(1, 2))[:, None]
    return (found[(slice(None), *at)] - fall <= least + ROUNDED).any(axis=0)


def _descended(distances, number, axes, offsets, known):
    last = len(offsets) - 1
    place, least = np.full(2, last // 2), np.inf
    while True:
        around = place + NINE
        around = around[((around >= 0) & (around <= last)).all(axis=1)]
        new = [each for each in map(tuple, around.tolist()) if each not in known]
        if new:
            found = distances.at(_shifts(axes, offsets, np.array(new)))
            known.update(zip(new, np.transpose(found), strict=True))
        values = np.array([known[tuple(each)][number] for each in around.tolist()])
        if values.min() >= least - ROUNDED:
            return float(np.hypot(*offsets[place]))
        place, least = around[np.argmin(values)], values.min()


def _shifts(axes, offsets, places):
    """Return the (K, 3) translations at (K, 2) places of the grid."""
    shifts = np.zeros((len(places), 3))
    shifts[:, ['xyz'.index(axis) for axis in axes]] = offsets[places]
    return shifts
