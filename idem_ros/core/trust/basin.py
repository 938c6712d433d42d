"""Whether a stage ended in a valley of q_tot, and where the guess was in it."""

import numpy as np

from idem_ros.core.arrays import Matrix6, Transform
from idem_ros.core.geometry import se3
from idem_ros.core.metric.balls import Balls
from idem_ros.core.trust.contrast import mean_contrast, sums_at_each
from idem_ros.core.trust.observability import middle_and_arm, unit_motions

SAMPLE = 64  # centres of each cloud, about
# How likely a solve succeeds: logistic in the logarithm of the mean contrast, its slope and where
# it is even; where the first stage ended, and where the last coarse one did.
FIRST, LAST = (2.13, 0.0615), (3.96, 0.0963)
LEAST_CONTRAST = 0.01
FARTHEST, PROBE = 5.0, 0.5  # of the radius


def confidence(balls: Balls, T_target_source: Transform, model: tuple[float, float]) -> float:
    """Return how likely a solve succeeds of which a coarse stage ended here, 0 to 1.

    In a valley every way out leads up: by how much q_mean rises a radius away, on average.
    """
    mean = mean_contrast(balls, T_target_source, _units(balls, T_target_source), SAMPLE)
    slope, middle = model
    return 1.0 / (1.0 + (middle / max(mean, LEAST_CONTRAST)) ** slope)


def gauge(balls: Balls, T_target_source: Transform, T_guess: Transform, way: float) -> float:
    """Return how far a guess was on the way from a minimum to the crown of maxima around it.

    0 at the minimum, 1 at the rim, more beyond. q_tot is probed along the one motion that leads
    through both poses, each half radius of the surfaces' motion, up to FARTHEST radii.

    Args:
        balls: `Balls` at a coarse radius.
        T_target_source: (4, 4) the minimum, between the clouds' origins.
        T_guess: (4, 4) likewise.
        way: `way_between` them.
    """
    twist = se3.log(T_guess @ se3.inverse(T_target_source))
    if way == 0.0:
        return 0.0
    places = np.arange(0.0, FARTHEST + PROBE, PROBE)
    transforms = se3.exps(places[:, None] * twist / way) @ T_target_source
    q, _ = sums_at_each(balls, transforms, SAMPLE)
    return way / places[max(int(np.argmax(q)), 1)]


def way_between(balls: Balls, T_target_source: Transform, T_guess: Transform) -> float:
    """Return how far the surfaces move from one pose to the other, over the radius."""
    twist = se3.log(T_guess @ se3.inverse(T_target_source))
    middle, arm = middle_and_arm(balls, T_target_source)
    turn = twist[:3]
    move = twist[3:] - se3.skew(middle) @ turn  # of the middle: v + omega x m
    return float(np.sqrt(arm**2 * (turn @ turn) + move @ move)) / balls.radius


def _units(balls: Balls, T_target_source: Transform) -> Matrix6:
    middle, arm = middle_and_arm(balls, T_target_source)
    return unit_motions(middle, np.eye(3) / arm)
