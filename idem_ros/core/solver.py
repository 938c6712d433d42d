"""Iterate on SE(3): linearise, step, stop; for any cost with a gradient and a matrix."""

from math import hypot
from time import perf_counter
from typing import NamedTuple

import numpy as np

from idem_ros.core import se3
from idem_ros.core.jit import kernel

FIRST_RELAXATION = 1.3  # the majoriser is wider than the cost: METHOD measured 25-30 % fewer steps
MOST_RELAXATION = 4.0
# The cost jumps where a member enters or leaves a ball. A minimum at such a jump is circled, not
# reached, unless from here on moves may only grow shorter.
PATIENCE = 15
LEAST_STIFFNESS = 1e-9  # of the stiffest direction; below it a direction is left where it is


class Solution(NamedTuple):
    """Where the iteration ended."""

    transform: np.ndarray  # (4, 4)
    matrix: np.ndarray  # (6, 6) Gauss-Newton matrix there, twist (omega, v)
    iterations: int
    converged: bool
    free: int  # directions without stiffness, left as they were


def minimize_on_se3(
    linearize,
    transform,
    max_iterations,
    rotation_tolerance,
    distance_tolerance,
    motions=None,
    deadline=np.inf,
):
    """Follow over-relaxed Gauss-Newton steps until one is short in rotation and translation.

    Args:
        linearize: transform -> (gradient (6,), matrix (6, 6)) for a twist (omega, v) on the left.
        transform: (4, 4) start.
        max_iterations: most steps.
        rotation_tolerance: [rad].
        distance_tolerance: in the unit of the translation.
        motions: (6, k) twists that steps are made of; None: any.
        deadline: of perf_counter [s]; the step under way at that time is the last.
    """
    relaxation, last = FIRST_RELAXATION, None
    for iteration in range(1, max_iterations + 1):
        gradient, matrix = linearize(transform)
        step, free = _step(matrix, gradient, motions)
        if last is not None:
            secant = _secant(relaxation, last, step, matrix)
            relaxation = secant if iteration <= PATIENCE else min(secant, relaxation)
        move = relaxation * step
        transform = se3.exp(move) @ transform
        last = step
        settled = step if iteration <= PATIENCE else move
        if hypot(*settled[:3]) <= rotation_tolerance and hypot(*settled[3:]) <= distance_tolerance:
            return Solution(transform, matrix, iteration, True, free)
        if perf_counter() > deadline:
            break
    return Solution(transform, matrix, iteration, False, free)


def _secant(relaxation, last, step, matrix):
    """Return Aitken's relaxation: how far along the last step would the step have vanished?"""
    change = step - last
    shrinking = -(last @ matrix @ change)
    curvature = change @ matrix @ change
    if shrinking <= 0.0 or relaxation * shrinking >= MOST_RELAXATION * curvature:
        return MOST_RELAXATION
    return relaxation * shrinking / curvature


def _step(matrix, gradient, motions):
    if motions is None:
        return newton_step(matrix, gradient)
    along, free = newton_step(motions.T @ matrix @ motions, motions.T @ gradient)
    return motions @ along, free


@kernel
def newton_step(matrix, gradient):
    """Return the step down, (n,), and the number of directions too loose for one.

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
