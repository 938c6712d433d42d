"""What to try next, given what the tries so far showed: no clouds, no solving."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from idem_ros.core.tuning import SOLVER

if TYPE_CHECKING:
    from idem_ros.core.solve.pair import Stage


class Try(NamedTuple):
    """One way to the first stage's minimum, and what it showed."""

    stages: tuple[Stage, ...]  # gone through, from the guess
    confidence: float  # that it ended in a valley, out of which every way leads up


def next_try(
    tries: Sequence[Try], first: Stage, wider: Stage | None, valley: float = SOLVER.valley
) -> tuple[Stage, ...]:
    """Return the stages to go through next, from the same guess; () where that is enough.

    A first stage that ends in no valley was too narrow for the guess: a wider one goes before it.

    Args:
        tries: each `Try` so far, in order.
        first: the first stage of the schedule.
        wider: one that is wider; None where its balls would hold most of a cloud.
        valley: confidence from which on it is one.
    """
    if not tries:
        return (first,)
    if wider is None or len(tries) > 1 or tries[0].confidence > valley:
        return ()
    return (wider, first)
