"""Centres that are added up by groups: in the order in which that is fastest."""

from collections.abc import Sequence

import numpy as np

from idem_ros.core.arrays import Indices, Integers
from idem_ros.core.jit import kernel
from idem_ros.core.workers import Workers, shares


def dealt_out(
    groups: Sequence[Integers], count: int, workers: Workers
) -> list[tuple[Indices, ...]]:
    """Return the indices of two clouds' centres in as many `shares` as workers take.

    Each group is wholly in one of them, one after another; so sums over it are the same, to the
    bit, for any workers.

    groups: (N,) which of count groups each centre is in, of either cloud.
    """
    parts, turns = shares(max(map(len, groups)), workers), [in_turn(g, count) for g in groups]
    if parts == 1:
        return [tuple(turns)]
    return [
        tuple(turn[group[turn] % parts == k] for turn, group in zip(turns, groups, strict=True))
        for k in range(parts)
    ]


@kernel
def in_turn(group: Integers, count: int) -> Integers:
    """Return the indices of centres, one group's after another's; each as in the cloud.

    group: (N,) which of count groups each is in.
    """
    start, order = np.zeros(count + 1, np.int64), np.empty(group.shape[0], np.int64)
    for g in group:
        start[g + 1] += 1
    for g in range(count):
        start[g + 1] += start[g]
    for i in range(group.shape[0]):
        order[start[group[i]]] = i
        start[group[i]] += 1
    return order
