"""Costs of two clouds at one radius, without the stages that choose it."""

from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.entropy import TWO_PI_E_CUBED
from idem_ros.core.solve.ball_cost import BallCost
from idem_ros.core.solve.cost import JointEntropy, NormalBalance


def ball_cost(radius, noise=0.005, tangential=False, apart=float('inf'), curvature=1.0):
    """Of balls whose lengths are over their radius; noise and apart are multiples of it."""
    return BallCost(
        r2=radius**2 * (1.0 + 1e-12),
        c=TWO_PI_E_CUBED / radius**6,
        noise=(noise * radius) ** 2,
        tangential=tangential,
        valued=False,
        apart2=(apart * radius) ** 2,
        curvature=curvature,
    )


def joint_entropy(target, source, radius, **parameters):
    return JointEntropy(Balls(target, source, radius), ball_cost(radius, **parameters))


def normal_balance(target, source, radius, **parameters):
    cost = ball_cost(radius, tangential=True, **parameters)
    return NormalBalance(Balls(target, source, radius), cost)
