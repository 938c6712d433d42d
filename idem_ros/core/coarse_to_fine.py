"""The stages of a registration, coarse to fine: each starts where the one before it ended."""

import numpy as np

from idem_ros.core.arrays import Transform, Twists
from idem_ros.core.retry import Try, next_try
from idem_ros.core.solve.cost import Linearization
from idem_ros.core.solve.descent import Descent, not_begun
from idem_ros.core.solve.newton import Criteria, Solution, Termination, minimize
from idem_ros.core.solve.pair import Pair, Stage, wider_stage
from idem_ros.core.solve.sweep_cost import MovingCost, of_common_twist, of_each_pose
from idem_ros.core.trust.basin import FIRST, LAST, confidence
from idem_ros.core.workers import OutOfTime

# Confidence in a coarse stage's valley below which later ones end after `patience` steps: garbage
# is at the 0.00013 of no contrast at all, of scans that end right 0.003 is the least.
HOPELESS = 0.0005


def descend(pair: Pair, T: Transform, motions: Twists | None = None) -> Descent:
    """Return the `Descent` from T; motions (6, k): those allowed, None: all.

    Once a coarse stage has ended in a deep valley, every other of those left is left out: the
    basin of the last one is reached without.
    """
    descent, rest = not_begun(T, pair.sweep), pair.stages
    try:
        if len(rest) > 1:
            descent, rest = _first_stage(pair, descent, motions), rest[1:]
        while rest:
            stage, rest = rest[0], rest[1:]
            descent = _through(pair, stage, descent, motions)
            if descent.confidence > pair.tuning.sure and len(rest) > 1:
                rest = rest[1:]
            elif rest and descent.cost and descent.confidence <= pair.tuning.sure:
                sure = confidence(descent.cost.balls, descent.solution.transform, LAST)
                descent = descent._replace(confidence=sure)
    except OutOfTime:
        return descent.late()._replace(cost=None)
    return descent


def at_guess(pair: Pair, T: Transform) -> Descent:
    """Return the `Descent` that leads nowhere, for an audit: at T, with the last stage's cost."""
    try:
        cost = pair.cost(pair.stages[-1])
        matrix = cost.linearize(T).matrix
    except OutOfTime:
        return not_begun(T, pair.sweep).late()
    return Descent(Solution(T, matrix, 0, Termination.NOT_STARTED, 0), cost, sweep=pair.sweep)


def minimum_beside(descent: Descent, pair: Pair, motions: Twists) -> Descent:
    """Return the `Descent` to the minimum beside an audited pose: by the last stage.

    It counts as not started: how its iteration ended says nothing of the pose.
    motions: (6, k), those allowed; none: it stays.
    """
    assert descent.cost is not None, 'an audited pose has the last stage to be judged by'
    if motions.shape[1] == 0:
        return descent
    T, criteria = descent.solution.transform, _criteria(pair, pair.stages[-1], descent)
    solution = minimize(descent.cost, T, criteria, motions)
    return descent._replace(solution=solution._replace(termination=Termination.NOT_STARTED))


def of_its_target(pair: Pair, descent: Descent) -> Descent:
    """Return a `Descent` whose cost is of the pair's target: a map's part follows the source."""
    if descent.cost is not None and descent.cost.balls.of[0] is pair.target:
        return descent
    stage, T = pair.stages[-1], descent.solution.transform
    if descent.moving is None or descent.sweep is None:
        return descent._replace(cost=pair.cost(stage))
    moving = MovingCost(pair, stage, descent.sweep)
    cost, _, _ = moving.at(descent.sweep.poses(T))
    return descent._replace(cost=cost, moving=moving)


def _first_stage(pair: Pair, start: Descent, motions: Twists | None) -> Descent:
    """Return the `Descent` to the end of the first stage, by the best of the tries it takes."""
    tries: list[Try] = []
    ends: list[Descent] = []
    first, wider, valley = pair.stages[0], wider_stage(pair), pair.tuning.valley
    while stages := next_try(tries, first, wider, valley):
        descent = start
        for stage in stages:
            descent = _through(pair, stage, descent, motions)
        assert descent.cost is not None, 'there is a stage to go through'
        balls = descent.cost.balls
        tries.append(Try(stages, confidence(balls, descent.solution.transform, FIRST)))
        ends.append(descent._replace(first=balls, confidence=tries[-1].confidence))
    best = max(ends, key=lambda end: end.confidence)
    return best._replace(iterations=sum(end.iterations for end in ends))


def _through(pair: Pair, stage: Stage, descent: Descent, motions: Twists | None) -> Descent:
    """Minimise one stage from where a `Descent` ended; return where it has led."""
    pair = pair.around(descent.solution.transform)
    if descent.sweep is not None and descent.sweep.is_solved:
        return _through_moving(pair, stage, descent, motions)
    cost = pair.cost(stage)
    solution = minimize(cost, descent.solution.transform, _criteria(pair, stage, descent), motions)
    steps = descent.iterations + solution.iterations
    path = descent.path + solution.path
    return descent._replace(solution=solution, cost=cost, iterations=steps, path=path)


def _through_moving(pair: Pair, stage: Stage, descent: Descent, motions: Twists | None) -> Descent:
    """Minimise a stage over the poses at the sweep's begin and end; return where it has led."""
    assert descent.sweep is not None, 'the source moves'
    moving = MovingCost(pair, stage, descent.sweep)
    start = descent.sweep.poses(descent.solution.transform)
    both = None if motions is None else of_each_pose(motions)
    solution = minimize(moving, start, _criteria(pair, stage, descent), both)
    cost, T, sweep = moving.at(solution.transform)
    steps = descent.iterations + solution.iterations
    rigid = of_common_twist(Linearization(np.zeros((1, 12)), solution.matrix[None]))
    solution = solution._replace(transform=T, matrix=rigid.matrix)
    return descent._replace(
        solution=solution, cost=cost, iterations=steps, moving=moving, sweep=sweep
    )


def _criteria(pair: Pair, stage: Stage, before: Descent) -> Criteria:
    """Return when a stage ends: sooner where the one before it ended nowhere."""
    config, tuning = pair.config, pair.tuning
    ease = 1.0 if stage.is_last else tuning.ease
    most = config.max_iterations
    if before.confidence < HOPELESS:
        most = int(min(most, tuning.patience))
    return Criteria(
        most,
        ease * config.rotation_tolerance,
        ease * config.translation_tolerance * stage.radius,
        pair.workers,
        tuning,
    )
