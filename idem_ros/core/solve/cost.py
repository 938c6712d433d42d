"""What the stages minimise: a cost has a value at a transform, and is linearised there."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Matrix6, Transform, Twist
from idem_ros.core.metric.balls import Balls
from idem_ros.core.solve.ball_cost import BallCost
from idem_ros.core.solve.block_sums import SUMS, of_both
from idem_ros.core.solve.linearization import NOT_MET, linearize
from idem_ros.core.solve.newton import decrement, newton_step
from idem_ros.core.workers import BLOCK, in_threads, shares


class Linearization(NamedTuple):
    """A cost near a transform, in a twist (omega, v) on its left."""

    gradient: Twist
    matrix: Matrix6


class JointEntropy:
    """q_tot of the joint cloud (Eq. 8), of balls whose members have weight and scatter.

    value = sum_i [h(Sigma_i + e I) - h(Sigma_own,i + e I)] over the balls that hold points of both
    clouds, h as in Eq. 4 and e a little noise. With the members of every ball held, and the
    concave log det majorised, it is linearised to its gradient and a matrix no flatter than it is.

    Args:
        balls: `Balls` of the two clouds.
        ball_cost: `BallCost`, without the tangential weighting.
    """

    def __init__(self, balls: Balls, ball_cost: BallCost) -> None:
        self.balls, self.ball_cost = balls, ball_cost
        # Each block is added up by one thread, the blocks in their order: the same bits for any.
        self._block = tuple(np.arange(len(cloud.order)) // BLOCK for cloud in balls.clouds)
        self._blocks = [int(block[-1]) + 1 for block in self._block]
        count = shares(max(map(len, self._block)), balls.workers)
        self._shares = [
            tuple(np.flatnonzero(block % count == k) for block in self._block)
            for k in range(count)
        ]

    def value(self, T_target_source: Transform) -> float:
        """Return q_tot at a transform.

        Not what steps are accepted by: on the way to a minimum it rises where points begin to
        meet, to the crown of maxima around it.
        """
        (value,), _, _ = self._at(T_target_source, self.ball_cost._replace(valued=True))
        return float(value)

    def linearize(self, T_target_source: Transform) -> Linearization:
        """Return the `Linearization` at a transform.

        Raises:
            OutOfTime: the workers of the balls are late.
        """
        _, (gradient,), (matrix,) = self._at(T_target_source, self.ball_cost)
        return Linearization(gradient, matrix)

    def _at(
        self, T_target_source: Transform, ball_cost: BallCost
    ) -> tuple[Floats, Floats, Floats]:
        balls, T = self.balls, np.ascontiguousarray(T_target_source)[None]
        sums = tuple(np.zeros((1, n, SUMS)) for n in self._blocks)
        what = balls.sides(T_target_source), NOT_MET, T, ball_cost
        in_threads(
            balls.workers, lambda share: linearize(*what, share, self._block, sums), self._shares
        )
        target, source = (of_side[0, :, None] for of_side in sums)
        return of_both(target, source, T)


class NormalBalance(JointEntropy):
    """Where the surfaces' pulls along their normals cancel: the last stage's estimating equation.

    g(T) = sum_i b_i (rho_i / k_i) sum_l J_l^T V_i (x_l - m_i) = 0, V = W^3 / tr(W)^2 in place of
    W = Sigma^-1 and b the `balance`: the gradient of no scalar. Its value, which vanishes where it
    holds, is the Newton decrement g^T M^-1 g / 2, M its Gauss-Newton matrix.
    """

    def value(self, T_target_source: Transform) -> float:
        """Return the Newton decrement at a transform."""
        gradient, matrix = self.linearize(T_target_source)
        step, _ = newton_step(matrix, gradient)
        return decrement(gradient, step)
