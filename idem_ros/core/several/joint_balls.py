"""The balls of one radius around the points of several clouds, with their members from all.

Points stand in the order of the cells of one grid that holds all clouds, so that the members of a
ball are near one another in memory, whatever clouds they are of.
"""

from collections.abc import Iterator, Sequence
from copy import copy
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Indices,
    Integers,
    Integers32,
    Mask,
    MomentRows,
    Points,
    Rotations,
    Transforms,
    Weights,
)
from idem_ros.core.geometry import symmetric3
from idem_ros.core.geometry.grid import CELL_MARGIN, Grid, build_grid
from idem_ros.core.jit import kernel
from idem_ros.core.metric.candidates import SKIN, Candidates
from idem_ros.core.metric.cloud import Cloud, neighbourhoods
from idem_ros.core.metric.moments import TIE, rotated, row_of
from idem_ros.core.several.joint_candidates import Centres, all_centres, others_around, thinned
from idem_ros.core.workers import ALONE, BLOCK, Workers, in_threads

SHARES = 16  # that blocks are handed out in: sums are the same for any number of threads
MOST_KEPT = 200_000_000  # candidates: 800 MB


class Lists(NamedTuple):
    """What stays while no cloud moves by more than the skin."""

    poses: Transforms  # (K, 4, 4) at which they were made
    order: Indices  # (N,): points in the order of the grid
    cloud: Integers32  # (N,): which cloud each is of, in that order
    grid: Grid
    centres: Centres
    # of each share's blocks of centres; None: too many to keep
    candidates: list[list[Candidates] | None]
    pairs: Integers  # (E, 2): clouds that share a ball, the lesser number first
    pair_of: Integers32  # (K, K): which of these two clouds are; -1: none


class Placed(NamedTuple):
    """All points where the poses put them, in the order of the grid."""

    points: Points  # (N, 3)
    weights: Weights  # (N, 7)
    own: MomentRows  # (N, 10): moments of the ball around each centre in its own cloud
    cloud: Integers32  # (N,)


class Union(NamedTuple):
    """All points where the poses put them, in the order of a grid of their own."""

    grid: Grid
    cloud: Integers32  # (N,): which cloud each is of, in that order
    unit: MomentRows  # (N, 10): of the ball around each in its own cloud, each point counting
    # once, in its own frame


class JointBalls:
    """The balls of several clouds at one radius, for poses near one another.

    Poses take the frames at the clouds' origins to one common frame.

    Args:
        clouds: `Cloud`s, two at least.
        radius: of the balls, > 0, in the clouds' unit.
        workers: for the kernels; the results are the same for any number of threads.
        most_kept: candidates that are kept, about; where there are more, they are listed anew in
            each step: slower, in less memory.
        most_centres: that balls are around, about, of those that `thinned` leaves; None: of all
            points.

    Raises:
        OutOfTime: the workers are late; so do all methods.
    """

    def __init__(
        self,
        clouds: Sequence[Cloud],
        radius: float,
        workers: Workers = ALONE,
        most_kept: int = MOST_KEPT,
        most_centres: float | None = None,
    ) -> None:
        self.radius, self.r2, self.workers = radius, radius * radius * TIE, workers
        self.among_voxels = all(cloud.is_reduced for cloud in clouds)
        self.count, self.most_kept, self.most_centres = len(clouds), most_kept, most_centres
        found = neighbourhoods(clouds, radius, workers)
        self.sizes = np.array([len(each.order) for each in found])
        self.begins = np.cumsum(self.sizes) - self.sizes
        self.points = np.concatenate([each.grid.points for each in found])
        self.weights = np.concatenate(
            [np.broadcast_to(each.weights, (len(each.order), 7)) for each in found]
        )
        self.own = np.concatenate([each.own for each in found])
        self.unit = np.concatenate([each.unit for each in found])
        self.cloud = np.repeat(np.arange(self.count, dtype=np.int32), self.sizes)
        self.reach = np.array([np.abs(each.grid.points).max(axis=0) for each in found])
        self._lists: Lists | None = None
        self._weight: Floats | None = None  # (N,) of each ball, once it is known

    def thinner(self, most_centres: float) -> 'JointBalls':
        """Return the balls around fewer of the same points, about so many."""
        fewer = copy(self)
        fewer.most_centres, fewer._lists, fewer._weight = most_centres, None, None
        return fewer

    def lists(self, poses: Transforms) -> Lists:
        """Return the `Lists` near poses, made again where clouds have moved."""
        if self._lists is None or not self._still_hold(self._lists, poses):
            self._lists = None  # two would take twice the memory
            self._lists = self._made(poses)
        return self._lists

    def placed(self, poses: Transforms) -> tuple[Lists, Placed]:
        """Return the `Lists` near poses and the points there."""
        lists = self.lists(poses)
        n = len(lists.order)
        room = Placed(np.empty((n, 3)), np.empty((n, 7)), np.empty((n, 10)), lists.cloud)
        R, t = _rotations_and_translations(poses)
        where = self.points, self.weights, lists.order, (R, t)
        in_threads(self.workers, lambda span: _place(*where, span, room), block_spans(n))
        own = self.own, lists.order, R
        in_threads(
            self.workers,
            lambda share: [_place_own(*own, each.place, room) for each in share],
            [list(_blocks_of(lists.centres, share)) for share in range(SHARES)],
        )
        return lists, room

    def union_at(self, poses: Transforms) -> 'Union':
        """Return the `Union` of the clouds at poses."""
        points = _moved(self.points, self.cloud, *_rotations_and_translations(poses))
        grid, order = build_grid(points, self.radius * CELL_MARGIN * TIE)
        return Union(grid, self.cloud[order], self.unit[order])

    def blocks(self, lists: Lists, share: int) -> Iterator[tuple[Centres, Candidates]]:
        """Yield the centres and their candidates of each block of one of the `SHARES`."""
        kept = lists.candidates[share]
        again = np.zeros((self.count, self.count), np.bool_)
        for k, some in enumerate(_blocks_of(lists.centres, share)):
            yield some, kept[k] if kept else self._listed(lists.grid, lists.cloud, some, again)

    def _still_hold(self, lists: Lists, poses: Transforms) -> bool:
        """Whether no two clouds have moved, against each other, by more than the skin."""
        moved = poses - lists.poses
        turned = (np.abs(moved[:, :3, :3]) @ self.reach[:, :, None])[:, :, 0]
        most = np.sort(np.linalg.norm(turned + np.abs(moved[:, :3, 3]), axis=1))
        return bool(most[-2:].sum() <= SKIN * self.radius)

    def _made(self, poses: Transforms) -> Lists:
        points = _moved(self.points, self.cloud, *_rotations_and_translations(poses))
        grid, order = build_grid(points, self.radius * (1.0 + SKIN) * CELL_MARGIN * TIE)
        cloud = self.cloud[order]
        centres = self._centres(grid, order, cloud)
        found = in_threads(
            self.workers, lambda share: self._share(grid, cloud, centres, share), range(SHARES)
        )
        pairs = np.argwhere(np.logical_or.reduce([together for _, together in found]))
        pair_of = np.full((self.count, self.count), -1, np.int32)
        pair_of[tuple(pairs.T)] = pair_of[tuple(pairs.T[::-1])] = np.arange(len(pairs))
        candidates = [kept for kept, _ in found]
        return Lists(poses.copy(), order, cloud, grid, centres, candidates, pairs, pair_of)

    def _centres(self, grid: Grid, order: Indices, cloud: Integers32) -> Centres:
        """Return the `Centres`: the same points in all lists, chosen where the first are made."""
        if self.most_centres is None:
            return all_centres(len(order))
        if self._weight is None:
            number = (np.arange(len(order)) - self.begins[self.cloud])[order]
            self._weight = np.empty(len(order))
            self._weight[order] = thinned(grid, cloud, number, self.most_centres, self.count)
        weight = self._weight[order]
        place = np.flatnonzero(weight)
        return Centres(place, weight[place])

    def _share(
        self, grid: Grid, cloud: Integers32, centres: Centres, share: int
    ) -> tuple[list[Candidates] | None, Mask]:
        """Return the candidates of a share's blocks, and which clouds share a ball, (K, K)."""
        together = np.zeros((self.count, self.count), np.bool_)
        kept: list[Candidates] | None = []
        for some in _blocks_of(centres, share):
            each = self._listed(grid, cloud, some, together)
            if kept is not None:
                kept.append(each)
                if sum(len(block.member) for block in kept) > self.most_kept // SHARES:
                    kept = None
        return kept, together

    def _listed(self, grid: Grid, cloud: Integers32, some: Centres, together: Mask) -> Candidates:
        reach = self.radius * TIE + SKIN * self.radius
        return Candidates(*others_around(grid, cloud, some.place, reach * reach, together))


def block_spans(n: int) -> list[tuple[int, int]]:
    """Return (begin, end) of blocks of n centres: the same for any workers."""
    return [(begin, min(begin + BLOCK, n)) for begin in range(0, n, BLOCK)]


def _blocks_of(centres: Centres, share: int) -> Iterator[Centres]:
    spans = block_spans(len(centres.place))
    for begin, end in spans[len(spans) * share // SHARES : len(spans) * (share + 1) // SHARES]:
        yield Centres(centres.place[begin:end], centres.weight[begin:end])


def _rotations_and_translations(poses: Transforms) -> tuple[Rotations, Points]:
    R, t = poses[:, :3, :3], poses[:, :3, 3]
    return np.ascontiguousarray(R), np.ascontiguousarray(t)


@kernel
def _moved(points: Points, cloud: Integers32, R: Rotations, t: Points) -> Points:
    moved = np.empty(points.shape)
    for i in range(points.shape[0]):
        c = cloud[i]
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for a in range(3):
            moved[i, a] = R[c, a, 0] * x + R[c, a, 1] * y + R[c, a, 2] * z + t[c, a]
    return moved


@kernel
def _place(
    points: Points,
    weights: Weights,
    order: Indices,
    poses: tuple[Rotations, Points],
    span: tuple[int, int],
    placed: Placed,
) -> None:
    """Fill a span of `Placed` with points and scatters turned to the common frame."""
    R, t = poses
    for i in range(span[0], span[1]):
        j, c = order[i], placed.cloud[i]
        x, y, z = points[j, 0], points[j, 1], points[j, 2]
        for a in range(3):
            placed.points[i, a] = R[c, a, 0] * x + R[c, a, 1] * y + R[c, a, 2] * z + t[c, a]
        w = weights[j]
        scatter = symmetric3.rotated(R[c], (w[1], w[2], w[3], w[4], w[5], w[6]))
        placed.weights[i, 0] = w[0]
        for a in range(6):
            placed.weights[i, 1 + a] = scatter[a]


@kernel
def _place_own(
    own: MomentRows, order: Indices, R: Rotations, centres: Indices, placed: Placed
) -> None:
    """Fill rows of `Placed` with the own moments of centres, turned to the common frame."""
    i: int
    for i in centres:
        m = rotated(R[placed.cloud[i]], row_of(own, order[i]))
        for a in range(10):
            placed.own[i, a] = m[a]
