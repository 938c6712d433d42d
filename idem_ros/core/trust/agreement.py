"""How two clouds agree at a pose, point by point, and what of that speaks against the pose."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, MomentRows, Point, Points, Transform
from idem_ros.core.geometry import se3
from idem_ros.core.jit import kernel
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.noise import quantile
from idem_ros.core.metric.overlap import Overlap

TENTH = 0.9  # quantile of q_i: a tenth of the points that meet agree no better
NEAR = 1 / 3  # of the points that meet: the nearest ones


class Agreement(NamedTuple):
    """How the clouds agree at a pose, point by point; lengths over the radius."""

    q: Floats  # (N + M,): q_i (Eq. 7) of the target's and of the source's points
    reach: Floats  # (N + M,): points of the other cloud in reach
    meeting: int  # points of a cloud that have one, at the least
    overlap: Overlap  # shares of points that have one
    # (N, 10) and (M, 10): of a `Meeting`, the target's and the source's
    moments: tuple[MomentRows, MomentRows]


def discord(balls: Balls, agreement: Agreement, T_target_source: Transform) -> tuple[float, float]:
    """Return the q_i (Eq. 7) that a tenth of the points that meet exceed, lengths over the radius.

    Where surfaces coincide, joining them adds no entropy; where they stand apart, it does. Of all
    of these points, and of those nearest to the sensor: its noise grows with the range, so that
    what stands apart nearby is none.

    Args:
        balls: `Balls` of the last radius.
        agreement: the `Agreement` at the pose, where points meet.
        T_target_source: (4, 4) the pose, between the clouds' origins.

    Raises:
        OutOfTime: the workers of the balls are late.
    """
    balls.workers.require_time()
    target, source = balls.of
    sensor = -source.origin  # where the source frame has its origin
    sensors = se3.transform_points(T_target_source, sensor), sensor
    q, ranges = _meeting(target.points, source.points, sensors, agreement.q, agreement.reach)
    nearby = ranges <= quantile(ranges, NEAR)
    return quantile(q, TENTH), quantile(q[nearby], TENTH)


@kernel
def _meeting(
    target: Points, source: Points, sensors: tuple[Point, Point], q: Floats, reach: Floats
) -> tuple[Floats, Floats]:
    """Return q_i and squared distance from the sensor of the points that meet, the target's first.

    sensors: where it is in the frame of either.
    """
    found, squared = np.empty(len(q)), np.empty(len(q))
    n = 0
    for i in range(len(q)):
        if reach[i] == 0.0:
            continue
        k = i if i < len(target) else i - len(target)
        cloud = target if i < len(target) else source
        at = sensors[0] if i < len(target) else sensors[1]
        x, y, z = cloud[k, 0] - at[0], cloud[k, 1] - at[1], cloud[k, 2] - at[2]
        found[n], squared[n] = q[i], x * x + y * y + z * z
        n += 1
    return found[:n], squared[:n]
