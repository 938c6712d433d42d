"""The pairs across two clouds that are, or may soon be, neighbours: enumerated once, both ways.

As in molecular dynamics (Verlet lists): pairs within the radius and a skin stay candidates until
the source has moved by the skin.
"""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import (
    Integers,
    Integers32,
    Point,
    Points,
    RotationMatrix,
    Transform,
)
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.grid import Grid, bounds, neighbours, room_for
from idem_ros.core.jit import kernel
from idem_ros.core.metric.moments import into_frame, point_of
from idem_ros.core.workers import Workers, in_blocks

SKIN = 0.1  # of the radius: the later steps of a stage move less, and share one list
EXPECTED = 8  # candidates a point; the list grows where there are more


class Candidates(NamedTuple):
    """For each point of a cloud, points of the other: member[first[i]:first[i + 1]]."""

    first: Integers  # (N + 1,)
    member: Integers32  # (K,)


class CandidatePairs(NamedTuple):
    """The same pairs seen from the target and from the source."""

    of_target: Candidates
    of_source: Candidates
    transform: Transform  # T_target_source at which they were enumerated
    box: tuple[Point, Point]  # lowest and highest coordinates of the source


def candidate_pairs(
    target: Grid, source: Grid, T_target_source: Transform, reach: float, workers: Workers
) -> CandidatePairs:
    """Enumerate all pairs of two grids within reach, which is at most a cell of either."""
    if len(source.points) <= len(target.points):
        of_source = _candidates(
            source.points, target, se3.inverse(T_target_source), reach, workers
        )
        of_target = Candidates(*_transposed(*of_source, len(target.points)))
    else:
        of_target = _candidates(target.points, source, T_target_source, reach, workers)
        of_source = Candidates(*_transposed(*of_target, len(source.points)))
    return CandidatePairs(of_target, of_source, T_target_source, bounds(source.points))


def _candidates(
    points: Points, grid: Grid, T_points_grid: Transform, reach: float, workers: Workers
) -> Candidates:
    R, t = se3.rotation_and_translation(T_points_grid)

    def enumerate_block(begin: int, end: int) -> tuple[Integers, Integers32]:
        """Return the candidates of a block of points, as those of a cloud."""
        return _enumerate(points[begin:end], R, t, grid, reach**2)

    blocks = in_blocks(len(points), workers, enumerate_block)
    if len(blocks) == 1:
        return Candidates(*blocks[0])
    ends = np.cumsum([first[-1] for first, _ in blocks])
    firsts = [first[1:] + end - first[-1] for (first, _), end in zip(blocks, ends, strict=True)]
    members = np.concatenate([member for _, member in blocks])
    return Candidates(np.concatenate([np.zeros(1, np.int64), *firsts]), members)


def still_hold(pairs: CandidatePairs, T_target_source: Transform, skin: float) -> bool:
    """Whether no point of the source has moved by more than the skin since the enumeration."""
    return farthest_moved(T_target_source, pairs.transform, pairs.box) <= skin**2


@kernel
def farthest_moved(T: Transform, before: Transform, box: tuple[Point, Point]) -> float:
    """Return the greatest squared distance that points of a box move by from a transform to T.

    How far a point is moved is convex in the point: greatest in a corner.
    """
    most = 0.0
    for corner in range(8):
        square = 0.0
        for i in range(3):
            moved = T[i, 3] - before[i, 3]
            for k in range(3):
                moved += (T[i, k] - before[i, k]) * box[corner >> k & 1][k]
            square += moved * moved
        most = max(most, square)
    return most


@kernel
def _enumerate(
    points: Points, R: RotationMatrix, t: Point, grid: Grid, r2: float
) -> tuple[Integers, Integers32]:
    """Return where the candidates of each point begin and end, and all of them in a row.

    R, t take the grid's frame to that of the points.
    """
    n = points.shape[0]
    first, member = np.empty(n + 1, np.int64), np.empty(EXPECTED * n, np.int32)
    found, rows = room_for(grid)
    first[0] = at = 0
    for i in range(n):
        x, y, z = into_frame(point_of(points, i), R, t)
        count = np.int64(neighbours(x, y, z, grid, r2, found, rows))
        while at + count > member.shape[0]:
            member = np.concatenate((member, np.empty_like(member)))
        for c in range(np.uint64(count)):
            member[np.uint64(at) + c] = found[c]
        at += count
        first[i + 1] = at
    return first, member[:at].copy()  # a view would keep all of it


@kernel
def _transposed(first: Integers, member: Integers32, n_others: int) -> tuple[Integers, Integers32]:
    """Return the same pairs listed for the others, in the order of the first's points."""
    count = np.zeros(n_others + 2, np.int64)
    for c in range(member.shape[0]):
        count[member[c] + 2] += 1
    for j in range(2, n_others + 2):
        count[j] += count[j - 1]
    back = np.empty(member.shape[0], np.int32)
    for i in range(first.shape[0] - 1):
        for c in range(first[i], first[i + 1]):
            j = member[c] + 1
            back[count[j]] = i
            count[j] += 1
    return count[:-1], back
