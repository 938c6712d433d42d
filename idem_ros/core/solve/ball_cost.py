"""What a ball costs: the numbers of a stage, and how a ball's axes and halves are weighted."""

from typing import NamedTuple

from idem_ros.core.arrays import Moments, Symmetric
from idem_ros.core.geometry.symmetric3 import determinant, product, scaled, trace
from idem_ros.core.jit import inlined
from idem_ros.core.metric.entropy import MOST_WITHOUT_ENTROPY
from idem_ros.core.metric.moments import covariance

# Of the radius: standard deviation added to every axis of a covariance, so that an exact plane has
# an inverse. From 0.0001 on any up to this one gives the same.
NOISE = 0.005


class BallCost(NamedTuple):
    """What a ball's moments cost: numbers that every ball of a stage shares."""

    r2: float  # squared radius
    c: float  # (2 pi e)^3 over the unit of length to the sixth (Eq. 4)
    noise: float  # variance added to every axis of every covariance
    tangential: bool  # whether to leave out the pull along the surface: `without_tangential`
    apart2: float  # squared distance of a ball's two means that halves its weight; inf: none
    valued: bool  # whether the value is asked for, too
    # most that own means are moved by where the other's spread tells of curvature; 1: not at all
    curvature: float


@inlined
def without_tangential(w: Symmetric) -> Symmetric:
    """Return W^3 / tr(W)^2: each axis of Sigma by the square of its share of the pull.

    Along the surface the two clouds' means differ by where either happens to end or to be sampled,
    not by a misalignment: rings of a LiDAR would draw each other together.
    """
    f = 1.0 / trace(w)
    return scaled(product(product(w, w), w), f * f)


@inlined
def balance(joint: Moments, cross: Moments, apart2: float) -> float:
    """Return 1 / (1 + d^4 / apart^4) for means of the ball's two clouds that are d apart.

    Far apart they are two rings, or two sides of the overlap's rim: their difference is then more
    of the surface's shape than of a misalignment. Few points lie apart by chance, many do not.
    """
    n = joint[0] - cross[0]
    x = cross[1] / cross[0] - (joint[1] - cross[1]) / n
    y = cross[2] / cross[0] - (joint[2] - cross[2]) / n
    z = cross[3] / cross[0] - (joint[3] - cross[3]) / n
    apart = (x * x + y * y + z * z) / apart2
    return 1.0 / (1.0 + apart * apart)


@inlined
def curvature_of(joint: Moments, cross: Moments, most: float) -> float:
    """Return by how much more the other cloud's points spread about the centre, less 1.

    A curved surface leaves its tangent by as much as points spread along it: the mean of own
    points, times this, lies that much too near. The centre is one of them, and others of an even
    sampling keep off it. Of two samplings alike the one cloud's balls make up for the other's.
    """
    others = cross[4] + cross[7] + cross[9]
    own = joint[4] + joint[7] + joint[9] - others
    if own <= 0.0:
        return 0.0
    more = others / cross[0] * (joint[0] - cross[0]) / own
    return min(max(more, 1.0 / most), most) - 1.0


@inlined
def own_determinant(own: Moments, noise: float) -> float:
    """Return det (Sigma + noise I) of a ball's own members; 0 where they have no entropy."""
    if own[0] <= MOST_WITHOUT_ENTROPY:
        return 0.0
    return max(determinant(with_noise(covariance(own), noise)), 0.0)


@inlined
def with_noise(s: Symmetric, noise: float) -> Symmetric:
    """Return S + noise I."""
    xx, xy, xz, yy, yz, zz = s
    return xx + noise, xy, xz, yy + noise, yz, zz + noise
