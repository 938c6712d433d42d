"""Whether the surfaces that meet say anything of the clouds' scale.

A rigid motion cannot bring a cloud of another scale home, but three walls of a room always find
three others. Two things then show together: within the other cloud's extent half of the points
meet nothing; and what meets looks the same at any scale, as planes through a corner do when the
cloud grows about it. Each alone is common in right results: the first where scans see a thing from
two sides, the second in a corner of a room.
"""

from collections.abc import Sequence

import numpy as np

from idem_ros.core.arrays import Floats, Mask, Points, Transform
from idem_ros.core.geometry import se3
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.cloud import Neighbourhoods
from idem_ros.core.metric.measured_points import usual
from idem_ros.core.metric.overlap import Overlap
from idem_ros.core.trust.surfaces import own_surfaces

LEAST_MET = 0.55  # right results of scans from two sides have 0.45 and more
# Of a scan in a map: the map has more within its extent than the scan can see, but where so much
# of the scan meets, another scale would show.
LEAST_IN_MAP = 0.7
# Of how far growing moves points, how far along their surfaces' normals (upper quartile): right
# results with as little met have 0.40 and more, walls on walls at a wrong scale up to 0.29.
LEAST_GROWTH = 0.34
UPPER = 0.75  # quartile: of balls on edges the normals are anything
FLAT = 4.0  # least second variance of a surface over its first
SAMPLE = 2000  # balls of each cloud, about


def scale_left_open(
    balls: Balls, reach: Floats, overlap: Overlap, T_target_source: Transform
) -> str:
    """Say why a pose may be that of a cloud of another scale; empty where nothing speaks for it.

    Args:
        balls: `Balls` of the last radius.
        reach: (N + M,): points of the other cloud in reach of the target's and of the source's.
        overlap: the `Overlap` there.
        T_target_source: (4, 4) the pose, between the clouds' origins.
    """
    if overlap.in_map and overlap.most >= LEAST_IN_MAP:
        return ''
    sides = (balls.target, np.eye(4)), (balls.source, T_target_source)
    size = len(balls.target.order)
    of_each = reach[:size], reach[size:]
    # what meets lies within the extent: where most do, most of those there do
    if min(np.count_nonzero(r) / len(r) for r in of_each) >= LEAST_MET:
        return ''
    points = [se3.transform_points(T, side.grid.points) for side, T in sides]
    meets = [r[side.order] > 0.0 for (side, _), r in zip(sides, of_each, strict=True)]
    target, source = (se3.transform_points(T, usual(side.grid.points)) for side, T in sides)
    met = min(_met(target, points[1], meets[1]), _met(source, points[0], meets[0]))
    if met >= LEAST_MET or _growth(sides, points, meets) >= LEAST_GROWTH:
        return ''
    return (
        f'{1.0 - met:.0%} of the points within the extent of the other cloud meet nothing, and '
        'those that meet would at any scale: is the scale of both the same?'
    )


def _met(others: Points, points: Points, meets: Mask) -> float:
    """Return how many of the points within the others' extent have a neighbour there, 0 to 1."""
    within = ((points >= others.min(axis=0)) & (points <= others.max(axis=0))).all(axis=1)
    return meets[within].mean() if within.any() else 1.0


def _growth(
    sides: Sequence[tuple[Neighbourhoods, Transform]],
    points: Sequence[Points],
    meets: Sequence[Mask],
) -> float:
    """Return how far growing moves the surfaces that meet along their normals, 0 to 1.

    What no rigid motion does as well; over the distance that the points move.
    """
    some: list[Points] = []
    of_some: list[Points] = []
    for (side, T), p, met in zip(sides, points, meets, strict=True):
        balls = np.flatnonzero(met)
        balls = balls[:: max(len(balls) // SAMPLE, 1)]
        _, n, which = own_surfaces(side, (FLAT, 0.0), balls)
        some.append(p[which])
        of_some.append(n @ T[:3, :3].T)
    x, normals = np.vstack(some), np.vstack(of_some)
    if len(x) == 0:
        return 1.0
    x = x - x.mean(axis=0)
    arm = float(np.sqrt((x * x).sum(axis=1).mean()))
    if arm == 0.0:
        return 1.0
    grown: Floats = (x * normals).sum(axis=1) / arm
    moved: Floats = np.c_[np.cross(x, normals) / arm, normals]
    best, *_ = np.linalg.lstsq(moved, grown, rcond=None)
    return float(np.quantile(np.abs(grown - moved @ best), UPPER))
