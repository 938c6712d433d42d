"""Which motions the surfaces of two clouds determine, and which are unobservable.

A surface determines a motion along its normal. Normals are known to their noise, which in a plane
or a corridor looks like a little of it in every direction. So each ball takes its normal twice,
n_A from the target's points in it and n_B from the source's: their noises are independent, and the
mean of (n_A . motion)(n_B . motion) over the balls is zero, but for chance, where nothing does.
"""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Indices,
    Integer,
    Integers,
    Mask,
    Matrix3,
    Matrix6,
    Point,
    Points,
    RotationMatrix,
    Side,
    Symmetric,
    Transform,
    Triple,
    Twist,
    Twists,
)
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.symmetric3 import adjugate, determinant, thinnest_axis, trace
from idem_ros.core.jit import kernel
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.moments import (
    ball_moments,
    covariance,
    into_frame,
    point_of,
    rotated,
    row_of,
)
from idem_ros.core.solve.cost import JointEntropy

# Of the mean square along the normals: planes, corridors, poles and spheres leave at most 0.0015
# where they are free, the scenes of `python -m benchmarks accuracy` hold by 0.009 or more, and
# an exact surface may hold by less and yet firmly.
LEAST_STRENGTH = 0.005
CHANCE = 3.0  # standard errors
NORMALS = 2.0  # variances of a normal
HOLDING = 0.5  # of what a motion moves a surface along its normal at most: such determine it
ROUNDING = 1e-9  # what exact surfaces, or no surface at all, leave of the strength of others
LEAST_BALLS = 100  # fewer may happen to lie in one plane
SAMPLE = 1024  # centres of each cloud, about
LEAST_MEMBERS = 5.0  # of either cloud in a ball: three fix a plane, the others its noise
FLAT = 4.0  # least second variance of a surface over its first


class Observability(NamedTuple):
    """How firmly each of six motions is determined, the loosest first."""

    strength: Floats  # (6,): mean square of a unit motion along the normals
    error: Floats  # (6,): its standard error
    noise: float  # mean variance of a normal [rad^2]
    motions: Twists  # (6, 6): columns (omega, v) in the frame at the target's origin, each of
    # which moves the surfaces by about 1
    units: Twists  # (6, 6): `unit_motions` that they are made of
    lever_arm: float  # how far from their middle the surfaces reach
    # (balls, 6): how far each motion moves the surface in a ball along its normal
    along: Floats
    centres: tuple[Indices, Indices]  # which of the target's and the source's the balls are
    observable: Mask  # (6,) bool: not where nothing but chance or noise determines it

    @property
    def held(self) -> Twists:
        """The motions (6, k) that are observable."""
        return self.motions[:, self.observable]

    @property
    def free(self) -> Twists:
        """The motions (6, k) that are not."""
        return self.motions[:, ~self.observable]

    def determined_by(self, k: Integer) -> tuple[Twist, tuple[Indices, Indices]]:
        """Return the k-th motion, (6,), such that it moves a surface by 1 along its normal.

        That which it moves most; and which centres, of the target and of the source, it moves by
        more than half of that: those that determine it.
        """
        of_target, of_source = self.centres
        along = np.abs(self.along[:, k])
        most = along.max(initial=0.0)
        if most == 0.0:
            return self.motions[:, k], (of_target[:0], of_source[:0])
        those = np.flatnonzero(along > HOLDING * most)
        n = int(np.searchsorted(those, len(of_target)))
        return self.motions[:, k] / most, (
            of_target[those[:n]],
            of_source[those[n:] - len(of_target)],
        )


def observability_of(cost: JointEntropy, T_target_source: Transform) -> Observability:
    """Return the `Observability` of a cost's two clouds at a transform.

    Of a sample of the centres; of all, where by the sample a motion may be free.
    """
    found = _observability(cost, T_target_source, SAMPLE)
    if (found.strength < LEAST_STRENGTH).any():
        found = _observability(cost, T_target_source, np.inf)
    return found


def _observability(cost: JointEntropy, T_target_source: Transform, sample: float) -> Observability:
    balls, to_source = cost.balls, se3.adjoint(se3.inverse(T_target_source))
    motions = zip(*se3.both_ways(T_target_source), strict=True)
    here, there = (
        _planes(side, motion, balls.r2, sample)
        for side, motion in zip(balls.sides(T_target_source), motions, strict=True)
    )
    centres = here.centre, there.centre
    x = np.concatenate([here.mean, se3.transform_points(T_target_source, there.mean)])
    if len(x) == 0:
        return _without_surfaces(cost, T_target_source, centres)
    pivot = x.mean(axis=0)
    scatter = (x - pivot).T @ (x - pivot) / len(x)
    lever_arm = max(float(np.sqrt(np.trace(scatter))), balls.radius)
    units = unit_motions(pivot, _turns(scatter, balls.radius))
    a = np.concatenate([here.own, there.own @ to_source]) @ units
    b = np.concatenate([here.other, there.other @ to_source]) @ units
    noise = float(np.concatenate([here.variance, there.variance]).mean())
    mean = a.T @ b / len(x)
    strength, axes = np.linalg.eigh((mean + mean.T) / 2)
    along = a @ axes
    products = along * (b @ axes)  # their mean is the strength
    variance = np.einsum('ij,ij->j', products, products) / len(x) - strength**2
    error = np.sqrt(np.maximum(variance, 0.0) / len(x))
    seen = _observable(strength, error, noise, len(x))
    motions = units @ axes
    return Observability(strength, error, noise, motions, units, lever_arm, along, centres, seen)


def _observable(strength: Floats, error: Floats, noise: float, balls: int) -> Mask:
    if 0 < balls < LEAST_BALLS:
        return np.ones(6, bool)
    by_chance = np.maximum(CHANCE * error, max(NORMALS * noise, ROUNDING))
    too_loose = strength + CHANCE * error < LEAST_STRENGTH
    return ~((strength < by_chance) & too_loose)


def _without_surfaces(
    cost: JointEntropy, T: Transform, centres: tuple[Indices, Indices]
) -> Observability:
    """Return the `Observability` of clouds without surfaces, such as lines, by their stiffness."""
    pivot, lever_arm = middle_and_arm(cost.balls, T)
    units = unit_motions(pivot, np.eye(3) / lever_arm)
    matrix = cost.linearize(T).matrix
    stiffness, axes = np.linalg.eigh(units.T @ matrix @ units)
    strength = stiffness / stiffness[-1] if stiffness[-1] > 0.0 else np.ones(6)
    error, along = np.zeros(6), np.empty((0, 6))
    seen = _observable(strength, error, 0.0, 0)
    return Observability(
        strength, error, 0.0, units @ axes, units, lever_arm, along, centres, seen
    )


def unit_motions(pivot: Point, turns: Matrix3) -> Matrix6:
    """Return (6, 6): columns (omega, v) that turn about a pivot by turns (3, 3), or move by 1."""
    units = np.eye(6)
    units[:3, :3] = turns
    units[3:, :3] = se3.skew(pivot) @ turns
    return units


def _turns(scatter: Matrix3, least: float) -> Matrix3:
    """Return (3, 3) rotations that move points of a (3, 3) scatter by 1, root mean square.

    A corridor is turned farther about its axis than across it: its walls are near to that axis.
    """
    squares, axes = np.linalg.eigh(np.trace(scatter) * np.eye(3) - scatter)
    return axes / np.sqrt(np.maximum(squares, least**2)) @ axes.T


def middle_and_arm(balls: Balls, T_target_source: Transform) -> tuple[Point, float]:
    """Return the source's middle in the target's frame, (3,), and how far its points are from it.

    Between the clouds' origins; the arm is a root mean square, and a radius at least.
    """
    middle, square = _mean_and_variance(balls.source.grid.points)
    return se3.transform_points(T_target_source, middle), max(np.sqrt(square), balls.radius)


@kernel
def _mean_and_variance(points: Points) -> tuple[Point, float]:
    """Return the mean of (N, 3) points, and their mean squared distance from it."""
    mean, square, n = np.zeros(3), 0.0, points.shape[0]
    for i in range(n):
        for k in range(3):
            mean[k] += points[i, k]
    mean /= n
    for i in range(n):
        for k in range(3):
            square += (points[i, k] - mean[k]) ** 2
    return mean, square / n


class _Planes(NamedTuple):
    """Of the surface in each ball, as the centres' cloud has it and as the other has it."""

    own: Floats  # (n, 6): j = (x times n, n), of mean x and normal n of the own points
    other: Floats  # (n, 6): of the other cloud's, the normals' signs alike
    mean: Points  # (n, 3): of the own points
    variance: Floats  # (n,): of a normal, the two clouds' geometric mean
    centre: Integers  # (n,): which one


def _planes(side: Side, motion: tuple[RotationMatrix, Point], r2: float, sample: float) -> _Planes:
    """Return the `_Planes` of every so-many-th ball, about as many as the sample."""
    n = len(side[0][0])
    stride = int(max(n // sample, 1))
    most = n // stride + 1
    room = _Planes(
        np.empty((most, 6)),
        np.empty((most, 6)),
        np.empty((most, 3)),
        np.empty(most),
        np.empty(most, np.int64),
    )
    found = _fill_planes(side, motion, r2, stride, room)
    return _Planes(
        room.own[:found],
        room.other[:found],
        room.mean[:found],
        room.variance[:found],
        room.centre[:found],
    )


@kernel
def _fill_planes(
    side: Side, motion: tuple[RotationMatrix, Point], r2: float, stride: int, planes: _Planes
) -> int:
    """Fill the `_Planes` of every stride-th centre's ball; return how many hold a surface."""
    n = 0
    (centres, own), (points, weights, first, member) = side
    R, t = motion
    for i in range(0, centres.shape[0], stride):
        if own[i, 0] < LEAST_MEMBERS or first[i + 1] == first[i]:
            continue
        p = point_of(centres, i)
        x = into_frame(p, R, t)
        _, m = ball_moments(x, points, weights, member, first[i], first[i + 1], r2)
        if m[0] < LEAST_MEMBERS:
            continue
        a, b = row_of(own, i), rotated(R, m)
        va, na = _normal(covariance(a))
        vb, nb = _normal(covariance(b))
        if va < 0.0 or vb < 0.0:
            continue
        xa = (p[0] + a[1] / a[0], p[1] + a[2] / a[0], p[2] + a[3] / a[0])
        xb = (p[0] + b[1] / b[0], p[1] + b[2] / b[0], p[2] + b[3] / b[0])
        sign = 1.0 if na[0] * nb[0] + na[1] * nb[1] + na[2] * nb[2] >= 0.0 else -1.0
        _fill(planes.own[n], xa, na, 1.0)
        _fill(planes.other[n], xb, nb, sign)
        planes.mean[n, 0], planes.mean[n, 1], planes.mean[n, 2] = xa
        planes.variance[n] = np.sqrt(va / a[0] * vb / b[0])
        planes.centre[n] = i
        n += 1
    return n


@kernel
def _normal(s: Symmetric) -> tuple[float, Triple]:
    """Return first variance over second, and the first's axis: the normal of a surface.

    -1 where a covariance is no surface's. The variance of a normal is this over the members.
    """
    det, minors, spread = determinant(s), trace(adjugate(s)), trace(s)
    if not (minors > 0.0 and FLAT * det * spread < minors * minors):
        return -1.0, (0.0, 0.0, 0.0)
    return max(det, 0.0) * spread / (minors * minors), thinnest_axis(s)


@kernel
def _fill(j: Floats, x: Triple, n: Triple, sign: float) -> None:
    j[0] = sign * (x[1] * n[2] - x[2] * n[1])
    j[1] = sign * (x[2] * n[0] - x[0] * n[2])
    j[2] = sign * (x[0] * n[1] - x[1] * n[0])
    j[3], j[4], j[5] = sign * n[0], sign * n[1], sign * n[2]
