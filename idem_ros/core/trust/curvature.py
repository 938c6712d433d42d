"""The cost's own curvature at a pose, which its matrix, a majoriser's, exceeds."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.arrays import Floats, Indices, Integers, Matrix6, Transform, Twists
from idem_ros.core.geometry import se3
from idem_ros.core.metric.candidates import CandidatePairs
from idem_ros.core.solve.block_sums import SUMS, of_both
from idem_ros.core.solve.cost import JointEntropy
from idem_ros.core.solve.linearization import linearize
from idem_ros.core.solve.newton import LEAST_STIFFNESS
from idem_ros.core.trust.observability import Observability

SAMPLE = 160  # centres of each cloud, about, that it is taken from
STEP = 0.02  # of the radius: between gradients; within the pairs' skin far beyond the arm, too
LEAST_CURVATURE, MOST_CURVATURE = 0.2, 1.5  # of the majoriser's


def curved(
    cost: JointEntropy, T_target_source: Transform, held: Twists, observability: Observability
) -> tuple[Twists, Twists]:
    """Return motions (6, k) in which the whole stiffness is the identity, and the curvature is.

    held: (6, k) motions of unit stiffness.
    """
    part, axes = _curvature(cost, T_target_source, held, observability)
    firm = held @ axes
    return firm, firm / np.sqrt(part)


def _curvature(
    cost: JointEntropy, T: Transform, held: Twists, observability: Observability
) -> tuple[Floats, Floats]:
    """Return the curvature over the majoriser's along axes (k, k) of the held motions, (k,).

    The majoriser is wider than the cost: by how much, a sample of the centres tells.
    """
    balls = cost.balls
    moved: Floats = np.linalg.norm(np.linalg.solve(observability.units, held), axis=0)
    steps = STEP * balls.radius / moved
    pairs = balls.pairs(T)
    sizes = [len(cloud.order) for cloud in balls.clouds]
    stride = max(min(sizes) // SAMPLE, 1)
    some = tuple(np.arange(0, size, stride) for size in sizes)
    nobody = tuple(np.zeros(size, np.int64) for size in sizes)
    places = [T, *(se3.exp(move) @ T for move in (steps * held).T)]
    found = [linearized(cost, at, some, nobody, 1, pairs) for at in places]
    pulls = np.concatenate([pull for pull, _ in found])
    stiffness: Matrix6 = found[0][1][0]
    change: Floats = (pulls[1:] - pulls[:1]) / steps[:, None]
    sampled = held.T @ stiffness @ held
    firmness = np.linalg.eigvalsh(sampled)
    if (firmness <= LEAST_STIFFNESS * firmness.max(initial=0.0)).any():  # it met not all surfaces
        return np.ones(len(sampled)), np.eye(len(sampled))
    part, axes = np.linalg.eigh(_symmetric(np.linalg.solve(sampled, change @ held)))
    return np.clip(part, LEAST_CURVATURE, MOST_CURVATURE), axes


def _symmetric(matrix: NDArray[np.floating[Any]]) -> Floats:
    return (matrix + matrix.T) / 2


def linearized(
    cost: JointEntropy,
    T: Transform,
    chosen: Sequence[Indices],
    regions: Sequence[Integers],
    count: int,
    pairs: CandidatePairs | None = None,
) -> tuple[Floats, Floats]:
    """Return gradients (G, 6) and Gauss-Newton matrices (G, 6, 6) of G regions of centres.

    chosen: indices of the target's centres, and of the source's; regions: which one each is in.
    """
    sums = tuple(np.zeros((2, count, SUMS)))
    sides = cost.balls.sides(T, pairs)
    # tuples: of lists the kernel would be compiled once more
    some = tuple(chosen), tuple(regions)
    linearize(sides, se3.both_ways(T), cost.ball_cost, *some, sums)
    _, pulls, stiffness = of_both(sums[0][None], sums[1][None], T)
    return pulls, stiffness
