"""How several clouds agree at poses: q_i (Eq. 7) in the union of all, and in each pair of them."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Integer,
    Integers32,
    Points,
    Rotations,
    Transforms,
    Triple,
)
from idem_ros.core.geometry.grid import neighbours, room_for
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.metric.entropy import entropy
from idem_ros.core.metric.moments import add_member, plus, point_of, rotated, row_of
from idem_ros.core.several.joint_balls import SHARES, JointBalls, Union, block_spans
from idem_ros.core.workers import in_threads


class JointAgreement(NamedTuple):
    """Sums over the points of each cloud, every point counting once."""

    q: Floats  # (K,): of q_i in the union of all clouds [nat]
    meeting: Floats  # (K,): points that have a neighbour in another cloud
    q_between: Floats  # (K, K): of q_i of the first cloud's points, joined with the second alone
    met: Floats  # (K, K): how many of the first cloud's points have a neighbour in the second
    sizes: Floats  # (K,): points

    @property
    def q_tot(self) -> float:
        """Eq. 8 over the union: the entropy of the joint cloud minus that of its parts."""
        return float(self.q.sum())

    def overlap(self, i: int, j: int) -> float:
        """Return the share of two clouds' points that have a neighbour in the other."""
        return float((self.met[i, j] + self.met[j, i]) / (self.sizes[i] + self.sizes[j]))

    def q_mean(self, i: int, j: int) -> float:
        """Return q_tot of two clouds alone per point that has a neighbour in the other; or 0."""
        met = self.met[i, j] + self.met[j, i]
        return float((self.q_between[i, j] + self.q_between[j, i]) / met) if met else 0.0


def agreement_at(balls: JointBalls, poses: Transforms, scale: float) -> JointAgreement:
    """Return the `JointAgreement` at poses (K, 4, 4); lengths are divided by the scale."""
    union = balls.union_at(poses)
    spans = block_spans(len(union.cloud))
    alone = np.zeros((len(spans), balls.count, 2))
    paired = np.zeros((SHARES, balls.count, balls.count, 2))
    R = np.ascontiguousarray(poses[:, :3, :3])

    def add(share: int) -> None:
        """Add the balls of a share to its sums."""
        for k in range(share, len(spans), SHARES):
            _add_differences(union, R, spans[k], (balls.r2, scale), alone[k], paired[share])

    in_threads(balls.workers, add, range(SHARES))
    (q, meeting), (q_between, met) = (
        np.moveaxis(alone.sum(0), -1, 0),
        np.moveaxis(paired.sum(0), -1, 0),
    )
    return JointAgreement(q, meeting, q_between, met, balls.sizes.astype(np.float64))


@kernel
def _add_differences(
    union: Union,
    rotations: Rotations,
    span: tuple[int, int],
    size: tuple[float, float],
    alone: Floats,
    paired: Floats,
) -> None:
    """Add q_i and 1 of the centres that meet another cloud to (K, 2), by pairs to (K, K, 2).

    span: of centres; size: squared radius, and what lengths are divided by.
    """
    grid, cloud, (r2, scale) = union.grid, union.cloud, size
    moments = np.zeros((alone.shape[0], 10))
    seen = np.empty(alone.shape[0], np.int32)
    found, rows = room_for(grid)
    for i in range(span[0], span[1]):
        p, a = point_of(grid.points, i), cloud[i]
        near = neighbours(p[0], p[1], p[2], grid, r2, found, rows)
        n = _add_by_cloud(p, grid.points, cloud, a, found[:near], moments, seen)
        if n == 0:
            continue
        own = rotated(rotations[a], row_of(union.unit, i))
        h, joint = entropy(own, scale), own
        for b in seen[:n]:
            m = row_of(moments, b)
            moments[b] = 0.0
            joint = plus(joint, m)
            paired[a, b, 0] += entropy(plus(own, m), scale) - h
            paired[a, b, 1] += 1.0
        alone[a, 0] += entropy(joint, scale) - h
        alone[a, 1] += 1.0


@inlined
def _add_by_cloud(
    p: Triple,
    points: Points,
    cloud: Integers32,
    own: Integer,
    found: Integers32,
    moments: Floats,
    seen: Integers32,
) -> int:
    """Add the moments of points found about p to those of their clouds (K, 10), all zero before.

    But of its own cloud. Return of how many clouds there are; seen: filled with these.
    """
    n = 0
    for j in found:
        b = cloud[j]
        if b == own:
            continue
        row = moments[b]
        seen[n] = b  # kept only if it is counted
        n += row[0] == 0.0
        d = points[j, 0] - p[0], points[j, 1] - p[1], points[j, 2] - p[2]
        add_member(row, d, 1.0)
    return n
