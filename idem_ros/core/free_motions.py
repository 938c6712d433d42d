"""Motions that no surface determines, or few: left as guessed, or found by what determines them.

The coarse stages draw the clouds together along a motion that little determines: by where scans
end, and by the pattern of the sensor. So they are gone through without it.
"""

from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np

from idem_ros.core.arrays import Point, Transform
from idem_ros.core.coarse_to_fine import descend, of_its_target
from idem_ros.core.geometry import se3
from idem_ros.core.metric.measured_points import usual
from idem_ros.core.solve.descent import Descent
from idem_ros.core.solve.pair import Pair
from idem_ros.core.solve.sweep import Sweep
from idem_ros.core.trust.observability import FIRM, Observability, observability_of
from idem_ros.core.trust.pattern import pattern_lines
from idem_ros.core.trust.surfaces import SURFACE, own_surfaces
from idem_ros.core.trust.translation_votes import (
    MANY_VOTES,
    PARTS,
    Slide,
    slide_along,
    smear_along,
)
from idem_ros.core.tuning import SolverTuning
from idem_ros.core.workers import OutOfTime

Found: TypeAlias = tuple[Descent, Observability | None]  # where one ended; None: it was late


def left_as_guessed(pair: Pair, T_guess: Transform, descent: Descent) -> Found:
    """Return a `Descent` along which motions that nothing determines are as guessed.

    With free motions "solve", and of an audit, as it is.

    Args:
        pair: the `Pair` of clouds.
        T_guess: (4, 4) between the clouds' origins.
        descent: along all motions, from there.

    Returns:
        The `Descent`, and the `Observability` where it ended; None if late.
    """
    try:
        if descent.cost is None:
            return descent, None
        if pair.config.mode == 'audit' or pair.config.free_motions == 'solve':
            return descent, _observability_there(pair, descent)
        return _along_observable(pair, T_guess, descent)
    except OutOfTime:
        return descent.late(), None


def ended(
    pair: Pair, descent: Descent, observability: Observability | None
) -> tuple[Pair, Descent, Observability]:
    """Return the pair as it lies where a `Descent` ended, that with its cost there, what is seen.

    observability: there, as far as there was time for it.

    Raises:
        OutOfTime: the pair's workers are late.
    """
    pair = _where(pair, descent)
    before, descent = descent, of_its_target(pair, descent)
    assert descent.cost is not None, 'it is of the last stage'
    descent.cost.balls.workers = pair.workers
    if observability is None or descent is not before:  # what it saw were another part's points
        observability = _observability_there(pair, descent)
    return pair, descent, observability


def _along_observable(pair: Pair, T_guess: Transform, descent: Descent) -> Found:
    observability = _observability(pair, descent)
    if descent.confidence < pair.tuning.nowhere:
        return descent, observability
    weak = _weak_direction(observability, pair.tuning)
    if weak is None:
        if 0 < observability.observable.sum() < 6:
            descent = descend(pair, T_guess, observability.constrained)
        return descent, observability
    k, direction = weak
    is_firm = _is_firm(observability, k, pair.tuning)
    if is_firm and not _is_doubtful(pair, descent, direction):
        return descent, observability
    others = observability.motions[:, observability.observable & (np.arange(6) != k)]
    without = descend(pair, T_guess, others)
    best, votes = _found_along(pair, without, direction), None
    for sweep in _as_it_may_smear(pair, descent, without, direction):
        votes = _votes(pair, best, direction) if votes is None else votes
        swept = pair._replace(sweep=sweep)
        found = _found_along(swept, descend(swept, T_guess, others), direction)
        more = _votes(pair, found, direction)
        if more > pair.tuning.more_votes * votes:
            best, votes = found, more
    return best


def _observability_there(pair: Pair, descent: Descent) -> Observability:
    """Return the `Observability` where a `Descent` ended, which is to stay there."""
    observability = _observability(pair, descent)
    weak = _weak_direction(observability, pair.tuning)
    if weak is None:
        return observability
    (k, direction), radius = weak, pair.stages[-1].radius
    slide, is_pattern = _slides(pair, descent, direction)
    coincides = slide.is_clear(radius) and abs(slide.way) < radius
    if is_pattern(0.0) or not (coincides or _is_firm(observability, k, pair.tuning)):
        return observability.without(direction)
    return observability


def _observability(pair: Pair, descent: Descent) -> Observability:
    assert descent.cost is not None, 'surfaces are seen by the balls of a cost'
    T = descent.solution.transform
    return observability_of(descent.cost, T, _where(pair, descent).wider_balls())


def _where(pair: Pair, descent: Descent) -> Pair:
    """Return the pair with what of it is at the end of a descent."""
    return pair.moved_by(descent.sweep).around(descent.solution.transform)


def _as_it_may_smear(
    pair: Pair, descent: Descent, without: Descent, direction: Point
) -> Iterator[Sweep]:
    """Yield a sweep of which nothing was known as a descent found it, and as surfaces vote.

    A smear along a direction hides what lies across it; what little determines it may mislead.

    Args:
        pair: the `Pair`, with the sweep that descents begin with.
        descent: along all motions.
        without: without the direction.
        direction: (3,).
    """
    sweep = pair.sweep
    if sweep is None or descent.sweep is None or not sweep.is_unknown:
        return
    yield sweep._replace(twist=descent.sweep.twist)
    if without.cost is None or without.moving is None or without.first is None:
        return  # it was late
    T, found, balls = without.solution.transform, without.moving.sweep, without.cost.balls
    target, source = (own_surfaces(cloud, SURFACE) for cloud in balls.clouds)
    parts = without.moving.times_of_centres(T, PARTS)[1][source[2]]
    reach = balls.radius, pair.tuning.reach * without.first.radius
    smear = smear_along(target[:2], (*source[:2], parts), T, direction, reach, found.fraction)
    assert found.twist is not None, 'it was solved'
    speed = smear / (found.end - found.begin) * direction @ T[:3, :3]
    yield sweep._replace(twist=found.twist + np.concatenate([np.zeros(3), speed]))


def _weak_direction(
    observability: Observability, tuning: SolverTuning
) -> tuple[int, Point] | None:
    """Return which motion is determined least, if weakly, and its direction.

    None where all are determined, or several directions are not.
    """
    weak: list[tuple[int, Point]] = []
    for k, direction in observability.ways(observability.strength < tuning.weak):
        if not weak or not observability.observable[k]:
            weak.append((k, direction))
    return weak[0] if len(weak) == 1 else None


def _is_firm(observability: Observability, k: int, tuning: SolverTuning) -> bool:
    """Whether much determines a motion, or many surfaces that lean a little: hills of a plain."""
    strength, gentle = observability.strength[k], observability.gentle[k]
    return bool(strength >= FIRM or gentle >= max(tuning.gentle, tuning.gentle_share * strength))


def _is_doubtful(pair: Pair, descent: Descent, direction: Point) -> bool:
    """Whether the sensor's pattern coincides where a descent ended, or surfaces do elsewhere."""
    assert descent.cost is not None, 'it was gone through'
    balls = descent.cost.balls
    if min(shapes.surfaces for shapes in balls.shapes()) > pair.tuning.no_lines:
        return False
    slide, is_pattern = _slides(pair, descent, direction)
    return is_pattern(0.0) or (slide.is_clear() and abs(slide.way) > balls.radius)


def _found_along(pair: Pair, without: Descent, direction: Point) -> Found:
    """Return the `Descent` to where what lies across a direction coincides; else as guessed.

    without: gone through without that direction.
    """
    if without.cost is None:
        return without, None
    T, radius = without.solution.transform, without.cost.balls.radius
    slide, is_pattern = _slides(pair, without, direction)
    is_near = abs(slide.way) < pair.tuning.reach * pair.stages[0].radius
    if is_near and slide.is_clear(radius) and not is_pattern(slide.way):
        T_slid = se3.translation(slide.way * direction) @ T
        last = descend(pair._replace(stages=pair.stages[-1:]), T_slid)
        off = direction @ (last.solution.transform[:3, 3] - T_slid[:3, 3])
        if last.cost is not None and abs(off) < pair.tuning.settled * radius:
            settled = last._replace(
                first=without.first,
                confidence=without.confidence,
                iterations=without.iterations + last.iterations,
            )
            confirmed = _observability(pair, settled).confirmed(direction)
            if confirmed is not None:
                return settled, confirmed
    return without, _observability(pair, without).without(direction)


def _votes(pair: Pair, found: Found, direction: Point) -> float:
    """Return how much coincides across a direction that is determined, where a descent ended."""
    descent, observability = found
    if observability is None:
        return 0.0
    if not observability.observable[observability.most_along(direction)]:
        return 0.0
    return _slides(pair, descent, direction)[0].votes


def _slides(
    pair: Pair, descent: Descent, direction: Point
) -> tuple[Slide, Callable[[float], bool]]:
    """Return the `Slide` along a direction, and whether the pattern coincides at a way."""
    assert descent.cost is not None, 'it was gone through'
    tuning, balls, T = pair.tuning, descent.cost.balls, descent.solution.transform
    wider = list(_where(pair, descent).wider_balls())
    along = direction, direction @ T[:3, :3]
    reach = max(np.ptp(usual(cloud.points) @ w) for cloud, w in zip(balls.of, along, strict=True))
    place = T, direction, balls.radius, float(reach)  # a better way is a rival, however far
    target, source = (own_surfaces(cloud, SURFACE)[:2] for cloud in balls.clouds)
    slide = slide_along(target, source, *place)
    lines, source_lines = (
        pattern_lines(cloud, [(each.clouds[side], each.radius) for each in wider], balls.workers)
        for side, cloud in enumerate(balls.clouds)
    )
    pattern, near = slide_along(lines, source_lines, *place), tuning.pattern_near * balls.radius
    around = tuning.reach * pair.stages[0].radius
    rules = pattern.votes >= MANY_VOTES and pattern.votes > tuning.pattern_votes * slide.votes
    return slide, lambda way: rules and pattern.rises(way, near, around) >= tuning.pattern_rise
