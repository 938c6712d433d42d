"""Iterate on SE(3), or on several poses: linearise, solve, accept, terminate; for any cost."""

from enum import Enum
from math import hypot
from typing import Any, NamedTuple, Protocol

import numpy as np

from idem_ros.core.arrays import Floats, Matrix6, Transform, Twist, Twists
from idem_ros.core.geometry import se3
from idem_ros.core.jit import kernel
from idem_ros.core.tuning import SOLVER, SolverTuning
from idem_ros.core.workers import ALONE, OutOfTime, Workers

MAJORISED = 2.0  # steps up to twice Newton's cannot raise a cost that its matrix majorises
LEAST_STIFFNESS = 1e-9  # of the stiffest direction; below it a direction is left where it is


class Termination(Enum):
    """How an iteration ended."""

    CONVERGED = 'converged'  # the step became short
    MAX_ITERATIONS = 'max_iterations'
    LATE = 'late'  # the budget was spent
    NOT_STARTED = 'not_started'  # there was nothing to move, or nothing should


class Cost(Protocol):
    """What is minimised."""

    def linearize(self, transform: Transform, /) -> tuple[Twist, Matrix6]:
        """Return gradient and matrix at a transform, for a twist (omega, v) on its left.

        Of several poses (K, 4, 4): (6 K,) and (6 K, 6 K), for a twist on the left of each.
        """
        ...


class Criteria(NamedTuple):
    """When the iteration ends."""

    max_iterations: int
    rotation: float  # a shorter step is the last [rad]
    translation: float  # likewise, in the unit of the translation
    workers: Workers = ALONE  # whose deadline ends it, too
    tuning: SolverTuning = SOLVER


class Solution(NamedTuple):
    """Where the iteration ended."""

    transform: Transform  # or the poses
    matrix: Matrix6  # Gauss-Newton matrix there, twist (omega, v)
    iterations: int
    termination: Termination
    singular: int  # directions without stiffness, left as they were
    path: tuple[Transform, ...] = ()  # where each step led that was kept

    @property
    def converged(self) -> bool:
        """Whether a step became short."""
        return self.termination is Termination.CONVERGED


def minimize(
    cost: Cost, transform: Transform, criteria: Criteria, motions: Twists | None = None
) -> Solution:
    """Follow over-relaxed Newton steps until one is short in rotation and translation.

    Args:
        cost: a `Cost`.
        transform: (4, 4) start; or (K, 4, 4), where the cost is one of several poses.
        criteria: `Criteria`.
        motions: (6, k) twists that steps are made of, or (6 K, k); None: any.
    """
    tuning, size = criteria.tuning, 6 * (transform.size // 16)
    relaxation, last = 1.0, None
    matrix, iteration, singular = np.zeros((size, size)), 0, 0
    path: list[Transform] = []
    end = Termination.MAX_ITERATIONS
    try:
        for iteration in range(1, criteria.max_iterations + 1):
            # Linearise: gradient and matrix, of the majorised Eq. 8 or of its estimating equation.
            gradient, matrix = cost.linearize(transform)
            # Solve: Newton's step.
            step, singular = _step(matrix, gradient, motions)
            left = decrement(gradient, step)
            # Accept the move that led here, or take it back to Newton's own.
            if last is not None and not accept(left, last.left, relaxation):
                relaxation, transform = 1.0, moved(last.transform, last.step)
                path[-1] = transform
                continue
            if last is not None:
                found = secant(relaxation, last.step, step, matrix, tuning.most_relaxation)
                relaxation = found if iteration <= tuning.patience else min(found, relaxation)
            last = _Move(transform, step, left)
            transform = moved(transform, relaxation * step)
            path.append(transform)
            # Terminate: where a step is short.
            if _is_short(step if iteration <= tuning.patience else relaxation * step, criteria):
                end = Termination.CONVERGED
                break
            criteria.workers.require_time()
    except OutOfTime:
        end = Termination.LATE
    return Solution(transform, matrix, iteration, end, singular, tuple(path))


def moved(transform: Transform, step: Twist) -> Transform:
    """Return a pose after a step (6,) on its left; or (K, 4, 4) poses after one (6 K,) of each."""
    if transform.ndim == 2:
        return se3.exp(step) @ transform
    steps = step.reshape(-1, 6)
    return np.array([se3.exp(twist) @ T for twist, T in zip(steps, transform, strict=True)])


def _is_short(step: Twist, criteria: Criteria) -> bool:
    return all(
        hypot(*step[k : k + 3]) <= criteria.rotation
        and hypot(*step[k + 3 : k + 6]) <= criteria.translation
        for k in range(0, len(step), 6)
    )


class _Move(NamedTuple):
    transform: Transform  # before it
    step: Twist  # Newton's there
    left: float  # the decrement there


def decrement(gradient: Twist, step: Twist) -> float:
    """Return by how much Newton's step lowers the cost with every ball's members held."""
    return -0.5 * float(gradient @ step)


def accept(left: float, before: float, relaxation: float) -> bool:
    """Whether a move is kept, given what the cost would still lose after it and before it.

    As far as the matrix majorises the cost, with the members held, no move can raise it. A farther
    one is an extrapolation: after one that leads where the next step is more than twice as long,
    it is taken back to Newton's own.
    """
    return relaxation <= MAJORISED or left <= MAJORISED**2 * before


def secant(
    relaxation: float,
    last: Floats,
    step: Floats,
    matrix: Any,
    most: float = SOLVER.most_relaxation,
) -> float:
    """Return Aitken's relaxation: how far along the last step would the step have vanished?

    Of steps (n,) and a matrix (n, n), which may be sparse; `most` at most.
    """
    change = step - last
    shrinking = -(last @ matrix @ change)
    curvature = change @ matrix @ change
    if shrinking <= 0.0 or relaxation * shrinking >= most * curvature:
        return most
    return float(relaxation * shrinking / curvature)


def _step(matrix: Matrix6, gradient: Twist, motions: Twists | None) -> tuple[Twist, int]:
    if motions is None:
        return newton_step(matrix, gradient)
    along, singular = newton_step(motions.T @ matrix @ motions, motions.T @ gradient)
    return motions @ along, singular


@kernel
def newton_step(matrix: Floats, gradient: Floats) -> tuple[Floats, int]:
    """Return the step down, (n,), and the number of directions without stiffness.

    Rotations and translations are scaled to the same stiffness first.
    """
    n = matrix.shape[0]
    scale, scaled = np.empty(n), np.empty((n, n))
    for i in range(n):
        scale[i] = 1.0 / np.sqrt(matrix[i, i]) if matrix[i, i] > 0.0 else 1.0
    for i in range(n):
        for k in range(n):
            scaled[i, k] = matrix[i, k] * scale[i] * scale[k]
    stiffness, axes = np.linalg.eigh(scaled)
    step, free = np.zeros(n), 0
    for k in range(n):
        if stiffness[k] > LEAST_STIFFNESS * max(stiffness[n - 1], 0.0):
            along = 0.0
            for i in range(n):
                along += axes[i, k] * scale[i] * gradient[i]
            for i in range(n):
                step[i] -= scale[i] * axes[i, k] * along / stiffness[k]
        else:
            free += 1
    return step, free
