"""The balls of one radius around the points of several clouds, with their members from all.

Points stand in the order of the cells of one grid that holds all clouds, so that the members of a
ball are near one another in memory, whatever clouds they are of.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import (
    Indices,
    Integer,
    Integers,
    Integers32,
    Mask,
    MomentRows,
    Points,
    Rotations,
    Transforms,
    Weights,
)
from idem_ros.core.blocks import ALONE, BLOCK, Workers, in_threads
from idem_ros.core.geometry import symmetric3
from idem_ros.core.geometry.grid import Grid, build_grid, neighbours, room_for
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.metric.candidates import EXPECTED, SKIN, Candidates
from idem_ros.core.metric.cloud import Cloud, neighbourhoods
from idem_ros.core.metric.moments import AS_MEASURED, TIE, point_of, rotated, row_of

SHARES = 16  # that blocks are handed out in: sums are the same for any number of threads
MOST_KEPT = 200_000_000  # candidates: 800 MB
MARGIN = 1.0 + 1e-9


class Lists(NamedTuple):
    """What stays while no cloud moves by more than the skin."""

    poses: Transforms  # (K, 4, 4) at which they were made
    order: Indices  # (N,): points in the order of the grid
    cloud: Integers32  # (N,): which cloud each is of, in that order
    grid: Grid
    # of each share's blocks of centres; None: too many to keep
    candidates: list[list[Candidates] | None]
    pairs: Integers  # (E, 2): clouds that share a ball, the lesser number first
    pair_of: Integers32  # (K, K): which of these two clouds are; -1: none


class Placed(NamedTuple):
    """All points where the poses put them, in the order of the grid."""

    points: Points  # (N, 3)
    weights: Weights  # (N, 7)
    own: MomentRows  # (N, 10): moments of the ball around each in its own cloud
    cloud: Integers32  # (N,)


class JointBalls:
    """The balls of several clouds at one radius, for poses near one another.

    Poses take the frames at the clouds' origins to one common frame.

    Args:
        clouds: `Cloud`s, two at least.
        radius: of the balls, > 0, in the clouds' unit.
        workers: for the kernels; the results are the same for any number of threads.
        most_kept: candidates that are kept, about; where there are more, they are listed anew in
            each step: slower, in less memory.

    Raises:
        OutOfTime: the workers are late; so do all methods.
    """

    def __init__(
        self,
        clouds: Sequence[Cloud],
        radius: float,
        workers: Workers = ALONE,
        most_kept: int = MOST_KEPT,
    ) -> None:
        self.radius, self.r2, self.workers = radius, radius * radius * TIE, workers
        self.count, self.most_kept = len(clouds), most_kept
        found = neighbourhoods(clouds, radius, workers)
        self.sizes = np.array([len(each.order) for each in found])
        self.points = np.concatenate([each.grid.points for each in found])
        self.weights = np.concatenate(
            [np.broadcast_to(each.weights, (len(each.order), 7)) for each in found]
        )
        self.own = np.concatenate([each.own for each in found])
        self.unit = np.concatenate([each.unit for each in found])
        self.cloud = np.repeat(np.arange(self.count, dtype=np.int32), self.sizes)
        self.reach = np.array([np.abs(each.grid.points).max(axis=0) for each in found])
        self._lists: Lists | None = None

    def lists(self, poses: Transforms) -> Lists:
        """Return the `Lists` near poses, made again where clouds have moved."""
        if self._lists is None or not self._still_hold(self._lists, poses):
            self._lists = None  # two would take twice the memory
            self._lists = self._made(poses)
        return self._lists

    def placed(self, poses: Transforms, counting_once: bool = False) -> tuple[Lists, Placed]:
        """Return the `Lists` near poses and the points there.

        counting_once: whether each point has the weight 1 and no scatter, whatever it stands for.
        """
        lists = self.lists(poses)
        n = len(lists.order)
        room = Placed(np.empty((n, 3)), np.empty((n, 7)), np.empty((n, 10)), lists.cloud)
        own = self.unit if counting_once else self.own
        weights = AS_MEASURED if counting_once else self.weights
        what = (self.points, weights, own), lists.order, _rotations_and_translations(poses)
        in_threads(self.workers, lambda span: _place(*what, span, room), block_spans(n))
        return lists, room

    def blocks(self, lists: Lists, share: int) -> Iterator[tuple[int, Candidates]]:
        """Yield (first centre, candidates) of each block of one of the `SHARES`."""
        kept = lists.candidates[share]
        again = np.zeros((self.count, self.count), np.bool_)
        for k, span in enumerate(_spans_of(len(lists.order), share)):
            yield (
                span[0],
                kept[k] if kept else self._listed(lists.grid, lists.cloud, span, again),
            )

    def _still_hold(self, lists: Lists, poses: Transforms) -> bool:
        """Whether no two clouds have moved, against each other, by more than the skin."""
        moved = poses - lists.poses
        turned = (np.abs(moved[:, :3, :3]) @ self.reach[:, :, None])[:, :, 0]
        most = np.sort(np.linalg.norm(turned + np.abs(moved[:, :3, 3]), axis=1))
        return bool(most[-2:].sum() <= SKIN * self.radius)

    def _made(self, poses: Transforms) -> Lists:
        points = _moved(self.points, self.cloud, *_rotations_and_translations(poses))
        grid, order = build_grid(points, self.radius * (1.0 + SKIN) * MARGIN * TIE)
        cloud = self.cloud[order]
        found = in_threads(
            self.workers, lambda share: self._share(grid, cloud, share), range(SHARES)
        )
        pairs = np.argwhere(np.logical_or.reduce([together for _, together in found]))
        pair_of = np.full((self.count, self.count), -1, np.int32)
        pair_of[tuple(pairs.T)] = pair_of[tuple(pairs.T[::-1])] = np.arange(len(pairs))
        candidates = [kept for kept, _ in found]
        return Lists(poses.copy(), order, cloud, grid, candidates, pairs, pair_of)

    def _share(
        self, grid: Grid, cloud: Integers32, share: int
    ) -> tuple[list[Candidates] | None, Mask]:
        """Return the candidates of a share's blocks, and which clouds share a ball, (K, K)."""
        together = np.zeros((self.count, self.count), np.bool_)
        kept: list[Candidates] | None = []
        for span in _spans_of(len(cloud), share):
            each = self._listed(grid, cloud, span, together)
            if kept is not None:
                kept.append(each)
                if sum(len(block.member) for block in kept) > self.most_kept // SHARES:
                    kept = None
        return kept, together

    def _listed(
        self, grid: Grid, cloud: Integers32, span: tuple[int, int], together: Mask
    ) -> Candidates:
        reach = self.radius * TIE + SKIN * self.radius
        return Candidates(*_others_around(grid, cloud, span, reach * reach, together))


def block_spans(n: int) -> list[tuple[int, int]]:
    """Return (begin, end) of blocks of n centres: the same for any workers."""
    return [(begin, min(begin + BLOCK, n)) for begin in range(0, n, BLOCK)]


def _spans_of(n: int, share: int) -> list[tuple[int, int]]:
    spans = block_spans(n)
    return spans[len(spans) * share // SHARES : len(spans) * (share + 1) // SHARES]


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
    what: tuple[Points, Weights, MomentRows],
    order: Indices,
    poses: tuple[Rotations, Points],
    span: tuple[int, int],
    placed: Placed,
) -> None:
    """Fill a span of `Placed` with points, scatters and moments turned to the common frame."""
    (points, weights, own), (R, t) = what, poses
    each = np.int64(weights.shape[0] > 1)
    for i in range(span[0], span[1]):
        j, c = order[i], placed.cloud[i]
        x, y, z = points[j, 0], points[j, 1], points[j, 2]
        for a in range(3):
            placed.points[i, a] = R[c, a, 0] * x + R[c, a, 1] * y + R[c, a, 2] * z + t[c, a]
        w = weights[j * each]
        scatter = symmetric3.rotated(R[c], (w[1], w[2], w[3], w[4], w[5], w[6]))
        placed.weights[i, 0] = w[0]
        for a in range(6):
            placed.weights[i, 1 + a] = scatter[a]
        m = rotated(R[c], row_of(own, j))
        for a in range(10):
            placed.own[i, a] = m[a]


@kernel
def _others_around(
    grid: Grid, cloud: Integers32, span: tuple[int, int], r2: float, together: Mask
) -> tuple[Integers, Integers32]:
    """Return the candidates of a span of the grid's points: those near, but of other clouds.

    Of each point cloud by cloud. Mark (K, K) which clouds share one of the balls.
    """
    begin, end = span
    count = together.shape[0]
    first = np.empty(end - begin + 1, np.int64)
    member = np.empty(EXPECTED * (end - begin), np.int32)
    found, rows = room_for(grid)
    place, seen = np.zeros(count, np.int64), np.empty(count, np.int32)
    first[0] = at = 0
    for i in range(begin, end):
        x, y, z = point_of(grid.points, i)
        near = np.int64(neighbours(x, y, z, grid, r2, found, rows))
        while at + near > member.shape[0]:
            member = np.concatenate((member, np.empty_like(member)))
        clouds = 0
        for c in range(np.uint64(near)):
            b = cloud[found[c]]
            seen[clouds] = b  # kept only if it is counted
            clouds += place[b] == 0
            place[b] += 1
        at = _place_by_cloud(cloud, found[:near], seen[:clouds], cloud[i], (member, place), at)
        _mark(seen[:clouds], together)
        first[i - begin + 1] = at
    return first, member[:at].copy()


@inlined
def _place_by_cloud(
    cloud: Integers32,
    found: Integers32,
    seen: Integers32,
    own: Integer,
    into: tuple[Integers32, Integers],
    at: Integer,
) -> Integer:
    """Write those found, but of their own cloud, to member from `at` on; return where it ends.

    into: member, and how many are of each cloud (K,), which is left at zero.
    """
    member, place = into
    for b in seen:
        n = np.int64(place[b])
        place[b] = at
        if b != own:
            at += n
    for j in found:
        b = cloud[j]
        if b != own:
            member[place[b]] = j
            place[b] += 1
    for b in seen:
        place[b] = 0
    return at


@inlined
def _mark(seen: Integers32, together: Mask) -> None:
    for p in range(len(seen)):
        for q in range(p):
            together[min(seen[p], seen[q]), max(seen[p], seen[q])] = True
