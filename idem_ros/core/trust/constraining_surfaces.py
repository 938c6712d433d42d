"""Which balls determine a motion: those whose surface it moves the most along its normal."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Indices, Integers, Mask, Twists
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.trust.observability import Observability

HOLDING = 0.5  # of what a motion moves a surface along its normal at most: such determine it
FEW = 16  # balls that alone do not tell what determines a motion


class Holders(NamedTuple):
    """A sample of the balls that determine each of k motions."""

    motions: Twists  # (6, k): each moves a surface by 1 along its normal
    centres: tuple[Indices, Indices]  # (n,) of the target, (m,) of the source: motion by motion
    motion: tuple[Integers, Integers]  # (n,) and (m,): which of the motions each determines


def holders_of(observability: Observability, sample: int) -> Holders:
    """Return the `Holders` of the observable motions, about so many of either cloud a motion.

    How far a motion moves a surface at most is told by all but a few: a ball on an edge may have
    any normal, and a distant one a long arm. Those that it moves by more than half of that
    determine it.
    """
    of_target, of_source = observability.centres
    most, rows, motion = _holding(
        observability.along, observability.observable, len(of_target), sample
    )
    centres = of_target[rows[0]], of_source[rows[1]]
    return Holders(observability.constrained / np.where(most > 0.0, most, 1.0), centres, motion)


@kernel
def _holding(
    along: Floats, observable: Mask, of_target: int, sample: int
) -> tuple[Floats, tuple[Integers, Integers], tuple[Integers, Integers]]:
    """Return how far each observable motion moves a surface at most, (k,), and its holders.

    Of the target's rows, which are the first, and of the source's; and which motion each is for.
    """
    most, count, found = np.zeros(6), 0, np.zeros(2, np.int64)
    room = (2, 6 * len(along) + 1)
    rows, motion = np.empty(room, np.int64), np.empty(room, np.int64)
    for k in range(6):
        if not observable[k]:
            continue
        most[count] = _most_but_few(along[:, k])
        least = HOLDING * most[count] if most[count] > 0.0 else np.inf
        for s in range(2):
            begin, end = (0, of_target) if s == 0 else (of_target, len(along))
            first = last = found[s]
            for i in range(begin, end):
                rows[s, last] = i - begin  # kept only if it is counted
                last += abs(along[i, k]) > least
            for j in range(first, last, max(int(np.rint((last - first) / sample)), 1)):
                rows[s, found[s]], motion[s, found[s]] = rows[s, j], count
                found[s] += 1
        count += 1
    of_sides = rows[0, : found[0]], rows[1, : found[1]]
    return most[:count], of_sides, (motion[0, : found[0]], motion[1, : found[1]])


@inlined
def _most_but_few(values: Floats) -> float:
    """Return the FEW-th greatest of the magnitudes of values (n,); the least, of fewer."""
    size = min(FEW, len(values))
    greatest = np.zeros(FEW)  # in order, the least one first
    for value in values:
        j = 0
        while j + 1 < size and abs(value) > greatest[j + 1]:
            greatest[j] = greatest[j + 1]
            j += 1
        if abs(value) > greatest[j]:
            greatest[j] = abs(value)
    return greatest[0]
