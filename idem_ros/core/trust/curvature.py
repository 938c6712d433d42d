"""The cost's own curvature at a pose, which its matrix, a majoriser's, exceeds."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.arrays import Floats, Matrix6, Transform, Twists
from idem_ros.core.geometry import se3
from idem_ros.core.solve.block_sums import SUMS, of_both
from idem_ros.core.solve.cost import JointEntropy
from idem_ros.core.solve.linearization import NOT_MET, linearize
from idem_ros.core.solve.newton import LEAST_STIFFNESS

SAMPLE = 160  # centres of each cloud, about, that it is taken from
STEP = 0.02  # of the radius: between gradients; within the pairs' skin far beyond the arm, too
LEAST_CURVATURE, MOST_CURVATURE = 0.2, 1.5  # of the majoriser's


def stiff_and_curved(
    cost: JointEntropy, T_target_source: Transform, constrained: Twists, moved: Floats
) -> tuple[Twists, Twists]:
    """Return motions (6, k) in which the whole stiffness is the identity, and the curvature is.

    Args:
        cost: that of the last stage.
        T_target_source: (4, 4) where.
        constrained: (6, k) motions of unit stiffness.
        moved: (k,) how far each moves the surfaces.
    """
    part, axes = _curvature(cost, T_target_source, constrained, moved)
    firm = constrained @ axes
    return firm, firm / np.sqrt(part)


def _curvature(
    cost: JointEntropy, T: Transform, constrained: Twists, moved: Floats
) -> tuple[Floats, Floats]:
    """Return the curvature over the majoriser's along axes (k, k) of the observable motions, (k,).

    The majoriser is wider than the cost: by how much, a sample of the centres tells.
    """
    steps = STEP * cost.balls.radius / moved
    pulls, stiffness = _sampled(cost, T, (steps * constrained).T)
    change: Floats = (pulls[1:] - pulls[:1]) / steps[:, None]
    firmness, along = np.linalg.eigh(constrained.T @ stiffness @ constrained)  # in rising order
    if len(firmness) == 0 or firmness[0] <= LEAST_STIFFNESS * max(firmness[-1], 0.0):
        return np.ones(len(firmness)), np.eye(len(firmness))  # it met not all surfaces
    inverse = along / firmness @ along.T
    part, axes = np.linalg.eigh(_symmetric(inverse @ (change @ constrained)))
    return np.minimum(np.maximum(part, LEAST_CURVATURE), MOST_CURVATURE), axes


def _symmetric(matrix: NDArray[np.floating[Any]]) -> Floats:
    return (matrix + matrix.T) / 2


def _sampled(cost: JointEntropy, T: Transform, moves: Floats) -> tuple[Floats, Matrix6]:
    """Return the gradients (k + 1, 6) at a pose and after each of moves (k, 6), the matrix there.

    Of a sample of the centres, with the pairs of the pose.
    """
    balls, places = cost.balls, np.concatenate([T[None], se3.exps(moves) @ T])
    sizes = [len(cloud.order) for cloud in balls.clouds]
    stride = max(min(sizes) // SAMPLE, 1)
    # tuples: of lists the kernel would be compiled once more
    some = tuple(np.arange(0, size, stride) for size in sizes)
    one_group = tuple(np.zeros(size, np.int64) for size in sizes)
    sums = tuple(np.zeros((2, len(places), 1, SUMS)))
    linearize(balls.sides(T), NOT_MET, places, cost.ball_cost, some, one_group, sums)
    here, there = (of_side.reshape(1, -1, SUMS) for of_side in sums)
    _, pulls, stiffness = of_both(here, there, places)
    return pulls, stiffness[0]
