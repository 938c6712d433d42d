"""How several clouds agree at poses: q_i (Eq. 7) in the union of all, and in each pair of them."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Transforms
from idem_ros.core.blocks import in_threads
from idem_ros.core.jit import kernel
from idem_ros.core.metric.candidates import Candidates
from idem_ros.core.metric.entropy import entropy
from idem_ros.core.metric.moments import plus, row_of
from idem_ros.core.several.joint_balls import SHARES, JointBalls, Placed
from idem_ros.core.several.joint_linearization import members_by_cloud


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
    lists, placed = balls.placed(poses, counting_once=True)
    alone = np.zeros((SHARES, balls.count, 2))
    paired = np.zeros((SHARES, balls.count, balls.count, 2))

    def add(share: int) -> None:
        """Add the centres of a share to its sums."""
        for begin, candidates in balls.blocks(lists, share):
            size = balls.r2, scale
            _add_differences(placed, candidates, begin, size, alone[share], paired[share])

    in_threads(balls.workers, add, range(SHARES))
    (q, meeting), (q_between, met) = (
        np.moveaxis(alone.sum(0), -1, 0),
        np.moveaxis(paired.sum(0), -1, 0),
    )
    return JointAgreement(q, meeting, q_between, met, balls.sizes.astype(np.float64))


@kernel
def _add_differences(
    placed: Placed,
    candidates: Candidates,
    begin: int,
    size: tuple[float, float],
    alone: Floats,
    paired: Floats,
) -> None:
    """Add q_i and 1 of the centres that meet another cloud to (K, 2), by pairs to (K, K, 2).

    size: squared radius, and what lengths are divided by.
    """
    (first, member), (r2, scale) = candidates, size
    moments = np.empty((alone.shape[0], 10))
    seen = np.empty(alone.shape[0], np.int32)
    for k in range(first.shape[0] - 1):
        i = begin + k
        n = members_by_cloud(placed, i, (first[k], first[k + 1]), member, r2, moments, seen)
        if n == 0:
            continue
        own, a = row_of(placed.own, i), placed.cloud[i]
        h, joint = entropy(own, scale), own
        for q in range(n):
            b = seen[q]
            m = row_of(moments, b)
            joint = plus(joint, m)
            paired[a, b, 0] += entropy(plus(own, m), scale) - h
            paired[a, b, 1] += 1.0
        alone[a, 0] += entropy(joint, scale) - h
        alone[a, 1] += 1.0
