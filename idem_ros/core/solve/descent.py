"""Where a solve that goes through several stages has come to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Transform
from idem_ros.core.metric.balls import Balls
from idem_ros.core.solve.cost import JointEntropy
from idem_ros.core.solve.newton import Solution, Termination
from idem_ros.core.solve.sweep import Sweep
from idem_ros.core.solve.sweep_cost import MovingCost


class Descent(NamedTuple):
    """Where the stages gone through so far ended."""

    solution: Solution
    cost: JointEntropy | None = None  # of the latest stage; None: there was no time for one
    first: Balls | None = None  # of the first stage; None: there was one stage only
    iterations: int = 0  # over all stages
    confidence: float = np.nan  # that coarse stages ended in the right valley; nan: there are none
    moving: MovingCost | None = None  # of the latest stage, where the source's motion is solved
    sweep: Sweep | None = None  # there
    path: tuple[Transform, ...] = ()  # where each step led, over all stages; of one pose alone

    def late(self) -> Descent:
        """Return the same, ended because the budget was spent."""
        return self._replace(solution=self.solution._replace(termination=Termination.LATE))


def not_begun(T: Transform, sweep: Sweep | None = None) -> Descent:
    """Return the `Descent` through no stage: at T, with a `Sweep` whose motion is solved, too."""
    return Descent(Solution(T, np.zeros((6, 6)), 0, Termination.NOT_STARTED, 0), sweep=sweep)
