"""How far a result may be from the truth: a sandwich, curvature about the scatter of the pull.

At the minimum the pulls of all balls cancel. How much the rest would pull without those of one
region, and how far that would move the result, is a sample of its error: the jackknife.
"""

import numpy as np

from idem_ros.core.arrays import Floats, Matrix6, Transform, Twists
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.solve.cost import JointEntropy
from idem_ros.core.solve.newton import LEAST_STIFFNESS
from idem_ros.core.trust.curvature import stiff_and_curved
from idem_ros.core.trust.observability import Observability
from idem_ros.core.trust.regions import Regions

LEVERAGE = 0.95  # most of a motion's stiffness that one region may have: a finite variance
MOST_RULED = 0.95  # share of a motion's stiffness that lines have: a finite variance
FLOOR = 1e-4  # of the radius: where the solver stops


def covariance_of(
    cost: JointEntropy,
    T_target_source: Transform,
    observability: Observability,
    regions: Regions,
    in_common: float,
) -> Matrix6:
    """Return the (6, 6) covariance of a result's error, a twist (omega, v) on its left.

    Args:
        cost: that of the last stage.
        T_target_source: (4, 4) where.
        observability: there; along free motions the deviation is as far as the surfaces reach, or
            1 rad: more would leak into what is held, for the axes are not known exactly.
        regions: `by_region` there.
        in_common: as in `TrustTuning`.
    """
    matrix = regions.total.matrix
    constrained, moved, free = firm_and_loose(observability.constrained, matrix)
    free = np.concatenate([observability.free, free], axis=1)
    firm, roots = stiff_and_curved(cost, T_target_source, constrained, moved)
    wider = _widening(constrained, regions.ruled, in_common) @ matrix
    scatter = wider @ scatter_of(regions.pulls, regions.stiffness, firm, roots) @ wider.T
    units = observability.constrained
    floor = (FLOOR * cost.balls.radius) ** 2 * units @ units.T
    return scatter + floor + observability.lever_arm**2 * free @ free.T


def _widening(constrained: Twists, ruled: Matrix6, in_common: float) -> Matrix6:
    """Return (6, 6) that, times the matrix, takes errors to those with what lines have in common.

    Rings of both scans draw each other together wherever they fall, alike in all regions, which no
    jackknife sees. Where balls that hold lines have a share s of a motion's stiffness, surfaces
    alone would leave 1 / (1 - s) of its variance. Lines that err as these do, by a share of it
    that they have in common, move the result by s of that: s^2 / (1 - s) more.

    constrained: (6, k) motions of unit stiffness.
    """
    share, axes = np.linalg.eigh(constrained.T @ ruled @ constrained)
    share = np.minimum(np.maximum(share, 0.0), MOST_RULED)
    along = constrained @ axes
    return along * np.sqrt(1.0 + in_common * share**2 / (1.0 - share)) @ along.T


def model_error_covariance(error: tuple[float, ...]) -> Matrix6:
    """Return the (6, 6) covariance, x y z rx ry rz, of a length and an angle [deg] an axis."""
    length, degrees = error
    return np.diag(3 * [length**2] + 3 * [np.radians(degrees) ** 2])


def scatter_of(pulls: Floats, stiffness: Floats, firm: Twists, roots: Twists) -> Matrix6:
    """Return the jackknife's (n, n): the sum over regions of how far the rest would move."""
    n = firm.shape[1]
    shares, along = (firm.T @ stiffness @ firm).reshape(len(pulls), n * n), pulls @ roots
    return roots @ _jackknifed(shares, along) @ roots.T


def firm_and_loose(constrained: Twists, matrix: Floats) -> tuple[Twists, Floats, Twists]:
    """Return motions (n, k) of unit stiffness, how far each moves surfaces, and those without any.

    Args:
        constrained: (n, m) motions that move surfaces by 1.
        matrix: (n, n) stiffness.
    """
    stiffness, axes = np.linalg.eigh(constrained.T @ matrix @ constrained)
    firm = stiffness > LEAST_STIFFNESS * np.maximum(stiffness[-1:], 0.0)  # the greatest, if any
    moved = 1.0 / np.sqrt(stiffness[firm])
    return constrained @ axes[:, firm] * moved, moved, constrained @ axes[:, ~firm]


@kernel
def _jackknifed(shares: Floats, pulls: Floats) -> Floats:
    """Return the sum (k, k) of x x^T over regions, (I - LEVERAGE A) x = b of each.

    shares: (G, k k) of A, which are symmetric; pulls: (G, k) of b.
    """
    n = pulls.shape[1]
    total, rest, x = np.zeros((n, n)), np.empty((n, n)), np.empty(n)
    for g in range(len(pulls)):
        for i in range(n):
            x[i] = pulls[g, i]
            for k in range(n):
                rest[i, k] = -LEVERAGE * shares[g, n * i + k]
            rest[i, i] += 1.0
        _solve(rest, x)
        for i in range(n):
            for k in range(n):
                total[i, k] += x[i] * x[k]
    return total


@inlined
def _solve(matrix: Floats, x: Floats) -> None:
    """Replace x (n,) by matrix^-1 x, and the matrix, which is positive definite, by anything."""
    n = len(x)
    for j in range(n):
        for i in range(j + 1, n):
            f = matrix[i, j] / matrix[j, j]
            x[i] -= f * x[j]
            for k in range(j, n):
                matrix[i, k] -= f * matrix[j, k]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= matrix[i, k] * x[k]
        x[i] /= matrix[i, i]
