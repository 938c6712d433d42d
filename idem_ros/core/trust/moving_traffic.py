"""Whether what does not coincide at a pose does so at another: things that move along.

Among vehicles that drive along with it a sensor sees two bodies that move apart: what stands, and
what moves as it does itself. Each has a minimum of q_tot, at which the other seems to be seen by
one of the scans alone. Scans from two places have such surfaces, too, but they agree on no way to
each other.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Indices, Mask, Point, Points, Transform
from idem_ros.core.geometry import se3
from idem_ros.core.metric.balls import Balls, from_origins
from idem_ros.core.metric.cloud import Neighbourhoods
from idem_ros.core.trust.agreement import Agreement
from idem_ros.core.trust.observability import Observability
from idem_ros.core.trust.reasons import named
from idem_ros.core.trust.surfaces import ACROSS, SURFACE, own_surfaces
from idem_ros.core.trust.translation_votes import LEAST_VOTES, MOST_RIVAL, slide_along
from idem_ros.core.trust.verdict import LEAST_PROBABILITY, Assessment, Verdict

APART = 0.5  # [nat]: q_i of a ball with two surfaces a third of its radius apart
SAMPLE = 256  # balls of each cloud that coincide, and that do not, about
# Of the surfaces across a way that do not coincide: of 96 pairs of scans of places where nothing
# moves at most 0.28 did at one other pose, among vehicles that drive along 0.4 to 0.8.
MOSTLY = 1 / 3
# Of those that coincide: with less a body is no candidate; from LIKE on either may be the place.
LEAST, LIKE = 0.1, 0.5
NEAR = 0.4  # of the radius: nearer poses are not told apart
STILL = 0.15  # of the way between two poses: so far may vehicles that drive along fall behind
TURN = np.radians(10.0)  # hardly a vehicle turns more from scan to scan


class _Other(NamedTuple):
    """Another pose, at which surfaces coincide that do not at the one."""

    way: Point  # from the one, of the source in the target's frame
    here: float  # surfaces across it that coincide at the one
    there: float  # others that coincide at the other

    @property
    def is_like(self) -> bool:
        """Whether nearly as much coincides there."""
        return self.there >= LIKE * self.here

    def was_still(self, T_target_source: Transform, near: float) -> bool:
        """Whether at the one pose the sensor has not moved: nearer ones are not told apart."""
        moved, far = T_target_source[:3, 3], float(np.linalg.norm(self.way))
        is_near = abs(moved @ self.way) < near * far and np.linalg.norm(moved) < STILL * far
        return bool(is_near) and se3.rotation_angle(T_target_source) < TURN

    def moves_along(self, T_target_source: Transform) -> bool:
        """Whether the way to the other pose takes back how far the sensor has moved along it."""
        left, far = (T_target_source[:3, 3] + self.way) @ self.way, self.way @ self.way
        return bool(abs(left) < STILL * far) and se3.rotation_angle(T_target_source) < TURN


class _Some(NamedTuple):
    """Some surfaces of a cloud."""

    places: Points
    normals: Points  # (n, 3)
    balls: Indices  # (n,): whose they are
    each: float  # how many it stands for

    def across(self, ways: Floats) -> Mask:
        """Return which of them lie across a way, (3,): (n,); or across each of (3, d): (n, d)."""
        found: Mask = np.abs(self.normals @ ways) > ACROSS
        return found


def judged_beside_another(
    assessment: Assessment,
    balls: Balls,
    observability: Observability,
    agreement: Agreement,
    T_target_source: Transform,
    reach: float,
) -> Assessment:
    """Return an `Assessment` as it is; half as sure where another pose may be as good; and why.

    Args:
        assessment: the `Assessment` of a pose.
        balls: `Balls` of the last radius, that judged it.
        observability: there.
        agreement: the `Agreement` there.
        T_target_source: (4, 4) the pose, between the clouds' origins.
        reach: how far off another one is looked for, in the clouds' unit.
    """
    if not assessment.p_aligned >= LEAST_PROBABILITY or agreement.overlap.in_map:
        return assessment
    T, near = from_origins(*balls.of, T_target_source), NEAR * balls.radius
    others = list(_others(balls, observability, agreement, T_target_source, reach))
    doubtful = [each for each in others if each.is_like or each.was_still(T, near)]
    if doubtful:
        what, far = _what(doubtful, T_target_source)
        reason = f'{what} coincide {far:.2g} from here: do others move along with the sensor?'
        p = assessment.p_aligned / 2.0
        return replace(assessment, verdict=Verdict.MISALIGNED, p_aligned=p, reason=reason)
    along = [each for each in others if each.moves_along(T)]
    if not along:
        return assessment
    what, _ = _what(along, T_target_source)
    return replace(assessment, reason=f'{assessment.reason}; {what} move along with the sensor')


def _what(others: list[_Other], T: Transform) -> tuple[str, float]:
    """Return which surfaces coincide at that of other poses where most do, and how far off."""
    most = max(others, key=lambda each: each.there)
    across = named((T[:3, :3].T @ most.way)[:, None])
    share = most.there / (most.here + most.there)
    return f'{share:.0%} of the surfaces across {across}', float(np.linalg.norm(most.way))


def _others(
    balls: Balls,
    observability: Observability,
    agreement: Agreement,
    T: Transform,
    reach: float,
) -> Iterator[_Other]:
    """Yield each pose, a way along which all is held from T, where surfaces coincide apart."""
    size = len(balls.target.order)
    is_apart: Mask = (agreement.reach == 0.0) | (agreement.q > APART)
    left: list[_Some] = []
    met: list[_Some] = []
    for cloud, of_points in zip(balls.clouds, (is_apart[:size], is_apart[size:]), strict=True):
        of_balls = of_points[cloud.order]
        left.append(_some(cloud, np.flatnonzero(of_balls)))
        met.append(_some(cloud, np.flatnonzero(~of_balls)))
    ways = np.array([way for _, way in observability.ways(observability.observable)])
    ways = ways.reshape(-1, 3)
    of_each = ways, ways @ T[:3, :3]
    here, apart = _numbers(met, of_each), _numbers(left, of_each)
    for k in np.flatnonzero(apart >= LEAST * here):
        way, of_source = ways[k], of_each[1][k]
        target, source = (some[:2] for some in left)
        slide = slide_along(target, source, T, way, balls.radius, reach)
        if slide.rival > MOST_RIVAL * slide.votes or abs(slide.way) < NEAR * balls.radius:
            continue
        there = _coincide(balls, left, (way, of_source), se3.translation(slide.way * way) @ T)
        if there >= max(MOSTLY * apart[k], LEAST * here[k], LEAST_VOTES):
            yield _Other(slide.way * way, here[k], there)


def _some(cloud: Neighbourhoods, which: Indices) -> _Some:
    """Return the surfaces in a sample of some balls of a cloud."""
    stride = max(len(which) // SAMPLE, 1)
    return _Some(*own_surfaces(cloud, SURFACE, which[::stride]), float(stride))


def _numbers(of_both: list[_Some], ways: tuple[Points, Points]) -> Floats:
    """Return how many surfaces lie across each of ways, (d, 3) in either cloud's axes: (d,)."""
    target, source = (
        some.each * some.across(each.T).sum(axis=0)
        for some, each in zip(of_both, ways, strict=True)
    )
    return target + source


def _coincide(balls: Balls, left: list[_Some], ways: tuple[Point, Point], T: Transform) -> float:
    """Return how many of the surfaces across a way, in either cloud's axes, coincide at T."""
    chosen = [some.balls[some.across(way)] for some, way in zip(left, ways, strict=True)]
    total = 0.0
    for some, (q, members) in zip(left, balls.differences(T[None], chosen), strict=True):
        total += some.each * float(np.count_nonzero((q <= APART) & (members > 0.0)))
    return total
