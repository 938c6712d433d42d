"""Motions that the scene holds weakly or not at all: by what holds them alone, or as guessed.

The coarse stages draw the clouds together along a motion that little holds: by where the scans
end, and by the pattern of the sensor. So they are gone through without it.
"""

from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np

from idem_ros.core.arrays import Point, Transform
from idem_ros.core.geometry import se3
from idem_ros.core.metric.measured_points import usual
from idem_ros.core.metric.noise import share_of_sheets
from idem_ros.core.solve.descent import Descent
from idem_ros.core.solve.pair import Pair
from idem_ros.core.solve.sweep import Sweep
from idem_ros.core.stages import descend
from idem_ros.core.trust.observability import FIRM, Observability, observability_of
from idem_ros.core.trust.pattern import pattern_lines
from idem_ros.core.trust.slide import MANY_VOTES, PARTS, Slide, slide_along, smear_along
from idem_ros.core.trust.surfaces import SURFACE, own_surfaces

WEAK = 0.06  # strength: a pattern that locks holds by up to 0.05, real towns by 0.1 and more
GENTLE = 0.0005  # of the strength, of surfaces not across: bare scenes have half of that at most
MOSTLY = 0.15  # of the strength: plains have 0.2 and more, where a few surfaces hold 0.1
REACH = 2.0  # of the first radius: a guess is not taken to be farther off
SETTLED = 0.5  # of the radius: how far the last stage may go on from where surfaces coincide
ALL_SHEETS = 0.9  # of the balls: the others are too few lines to be a pattern
RULED = 6.0  # votes of the pattern over the surfaces': 10 to 30 where it locks, else to 3
# A way so near, of the radius, to one for which the pattern's votes rise by so much of what they
# rise at most is the pattern's: rings and columns coincide in many places.
LOCKED, RISEN = 0.3, 0.5
# Of votes, for another motion of the sweep: of one niche in sight any speed has nearly as many.
SURER = 1.05


Found: TypeAlias = tuple[Descent, Observability | None]  # where one ended; None: it was late


def held_to_guess(pair: Pair, T_guess: Transform, descent: Descent) -> Found:
    """Return a `Descent` along which motions that nothing holds are as guessed, and what it sees.

    Args:
        pair: the `Pair` of clouds.
        T_guess: (4, 4) between the clouds' origins.
        descent: along all motions, from there.

    Returns:
        The `Descent`, and the `Observability` where it ended; None if late.
    """
    seen = _seen_from(pair, descent)
    weak = _weak_direction(seen)
    if weak is None:
        free = 0 < seen.observable.sum() < 6
        return (descend(pair, T_guess, seen.held) if free else descent), seen
    k, way = weak
    if _is_firm(seen, k) and not _is_doubtful(pair, descent, way):
        return descent, seen
    others = seen.motions[:, seen.observable & (np.arange(6) != k)]
    kept = descend(pair, T_guess, others)
    best, votes = _slid(pair, kept, way), None
    for sweep in _as_it_may_smear(pair.sweep, descent, kept, way):
        votes = _votes(pair, best, way) if votes is None else votes
        swept = pair._replace(sweep=sweep)
        found = _slid(swept, descend(swept, T_guess, others), way)
        more = _votes(pair, found, way)
        if more > SURER * votes:
            best, votes = found, more
    return best


def seen_there(pair: Pair, descent: Descent) -> Observability:
    """Return the `Observability` where a `Descent` ended, which is to stay there."""
    seen = _seen_from(pair, descent)
    weak = _weak_direction(seen)
    if weak is None:
        return seen
    (k, way), radius = weak, pair.stages[-1].radius
    slide, is_locked = _slides(pair, descent, way)
    coincides = slide.is_clear(radius) and abs(slide.way) < radius
    if is_locked(0.0) or not (coincides or _is_firm(seen, k)):
        return seen.without(way)
    return seen


def _seen_from(pair: Pair, descent: Descent) -> Observability:
    assert descent.cost is not None, 'surfaces are seen by the balls of a cost'
    T = descent.solution.transform
    return observability_of(descent.cost, T, _where(pair, descent).wider_balls())


def _where(pair: Pair, descent: Descent) -> Pair:
    """Return the pair with what of it is at the end of a descent."""
    return pair.moved_by(descent.sweep).around(descent.solution.transform)


def _as_it_may_smear(
    sweep: Sweep | None, descent: Descent, kept: Descent, way: Point
) -> Iterator[Sweep]:
    """Yield a sweep of which nothing was known as a descent found it, and as surfaces vote.

    A smear along a way hides what lies across it; what little holds the way may mislead.

    Args:
        sweep: where descents begin.
        descent: along all motions.
        kept: without the way.
        way: (3,), the direction.
    """
    if sweep is None or descent.sweep is None or not sweep.is_unknown:
        return
    yield sweep._replace(twist=descent.sweep.twist)
    if kept.cost is None or kept.moving is None or kept.first is None:
        return  # it was late
    T, found, balls = kept.solution.transform, kept.moving.sweep, kept.cost.balls
    target, source = (own_surfaces(cloud, SURFACE) for cloud in balls.clouds)
    parts = kept.moving.times_of_centres(T, PARTS)[1][source[2]]
    reach = balls.radius, REACH * kept.first.radius
    smear = smear_along(target[:2], (*source[:2], parts), T, way, reach, found.fraction)
    assert found.twist is not None, 'it was solved'
    speed = smear / (found.end - found.begin) * way @ T[:3, :3]
    yield sweep._replace(twist=found.twist + np.concatenate([np.zeros(3), speed]))


def _weak_direction(seen: Observability) -> tuple[int, Point] | None:
    """Return which motion is held least, if weakly, and its direction.

    None where all are held, or several directions are not.
    """
    ways: list[tuple[int, Point]] = []
    for k in np.flatnonzero(seen.strength < WEAK):
        direction = seen.direction(k)
        if direction is not None and (not ways or not seen.observable[k]):
            ways.append((int(k), direction))
    return ways[0] if len(ways) == 1 else None


def _is_firm(seen: Observability, k: int) -> bool:
    """Whether much holds a motion, or many surfaces that lean a little: the hills of a plain."""
    strength, gentle = seen.strength[k], seen.gentle[k]
    return bool(strength >= FIRM or gentle >= max(GENTLE, MOSTLY * strength))


def _is_doubtful(pair: Pair, descent: Descent, way: Point) -> bool:
    """Whether the sensor's pattern coincides where a descent ended, or surfaces do elsewhere."""
    assert descent.cost is not None, 'it was gone through'
    balls = descent.cost.balls
    if min(share_of_sheets(cloud.own) for cloud in balls.clouds) > ALL_SHEETS:
        return False
    slide, is_locked = _slides(pair, descent, way)
    return is_locked(0.0) or (slide.is_clear() and abs(slide.way) > balls.radius)


def _slid(pair: Pair, kept: Descent, way: Point) -> Found:
    """Return the `Descent` to where what lies across a way coincides; else with it as guessed.

    kept: gone through without that way.
    """
    if kept.cost is None:
        return kept, None
    T, radius = kept.solution.transform, kept.cost.balls.radius
    slide, is_locked = _slides(pair, kept, way)
    is_near = abs(slide.way) < REACH * pair.stages[0].radius
    if is_near and slide.is_clear(radius) and not is_locked(slide.way):
        T_slid = se3.translation(slide.way * way) @ T
        last = descend(pair._replace(stages=pair.stages[-1:]), T_slid)
        off = way @ (last.solution.transform[:3, 3] - T_slid[:3, 3])
        if last.cost is not None and abs(off) < SETTLED * radius:
            steps = kept.iterations + last.iterations
            settled = last._replace(first=kept.first, confidence=kept.confidence, iterations=steps)
            confirmed = _seen_from(pair, settled).confirmed(way)
            if confirmed is not None:
                return settled, confirmed
    return kept, _seen_from(pair, kept).without(way)


def _votes(pair: Pair, found: Found, way: Point) -> float:
    """Return how much coincides across a way that is held, where a descent ended."""
    descent, seen = found
    if seen is None or not seen.observable[seen.most_along(way)]:
        return 0.0
    return _slides(pair, descent, way)[0].votes


def _slides(pair: Pair, descent: Descent, way: Point) -> tuple[Slide, Callable[[float], bool]]:
    """Return the `Slide` along a way, and whether the sensor's pattern coincides at another."""
    assert descent.cost is not None, 'it was gone through'
    balls, wider = descent.cost.balls, list(_where(pair, descent).wider_balls())
    T = descent.solution.transform
    ways = way, way @ T[:3, :3]
    reach = max(np.ptp(usual(cloud.points) @ w) for cloud, w in zip(balls.of, ways, strict=True))
    place = T, way, balls.radius, float(reach)  # a better way is a rival, however far
    target, source = (own_surfaces(cloud, SURFACE)[:2] for cloud in balls.clouds)
    slide = slide_along(target, source, *place)
    lines, source_lines = (
        pattern_lines(cloud, [(each.clouds[side], each.radius) for each in wider], balls.workers)
        for side, cloud in enumerate(balls.clouds)
    )
    pattern, near = slide_along(lines, source_lines, *place), LOCKED * balls.radius
    around = REACH * pair.stages[0].radius
    rules = pattern.votes >= MANY_VOTES and pattern.votes > RULED * slide.votes
    return slide, lambda way: rules and pattern.rises(way, near, around) >= RISEN
