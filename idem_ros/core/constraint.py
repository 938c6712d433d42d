"""Which motions the surfaces of two clouds hold, and which they leave free.

A surface holds a motion along its normal. Normals are known to their noise, which in a plane or a
corridor looks like a little hold in every direction. So each ball takes its normal twice, n_A from
the target's points in it and n_B from the source's: their noises are independent, and the mean of
(n_A . motion)(n_B . motion) over the balls is zero, but for chance, where nothing holds.
"""

from typing import NamedTuple

import numpy as np

from idem_ros.core import se3
from idem_ros.core.jit import kernel
from idem_ros.core.moments import (
    covariance,
    determinant,
    into_frame,
    raw_moments,
    rotated,
    row_of,
    unit_moments,
)

# Of the mean square along the normals: planes, corridors, poles and spheres leave at most 0.0015
# where they are free, the scenes of `idem bench accuracy` hold by 0.009 or more, and an exact
# surface may hold by less and yet firmly.
LEAST_STRENGTH = 0.005
CHANCE = 3.0  # standard errors
NOISE = 2.0  # variances of a normal
HOLDING = 0.5  # of what a motion moves a surface along its normal at most: such hold it
ROUNDING = 1e-9  # what exact surfaces, or no surface at all, leave of the strength of others
LEAST_BALLS = 100  # fewer may happen to lie in one plane
SAMPLE = 1024  # centres of each cloud, about
LEAST_MEMBERS = 5.0  # of either cloud in a ball: three fix a plane, the others its noise
FLAT = 4.0  # least second variance of a surface over its first
SQUARINGS = 4  # of a projector on the normal: (1/4)^16 is what they leave of the second axis


class Hold(NamedTuple):
    """How firmly each of six motions is held, the loosest first."""

    strength: np.ndarray  # (6,): mean square of a unit motion along the normals
    error: np.ndarray  # (6,): its standard error
    noise: float  # mean variance of a normal [rad^2]
    motions: np.ndarray  # (6, 6): columns (omega, v) in the frame at the target's origin, each of
    # which moves the surfaces by about 1
    units: np.ndarray  # (6, 6): `unit_motions` that they are made of
    arm: float  # how far from their middle the surfaces reach
    # (balls, 6): how far each motion moves the surface in a ball along its normal
    along: np.ndarray
    centres: tuple[np.ndarray, np.ndarray]  # which of the target's and the source's the balls are
    free: np.ndarray  # (6,) bool: which nothing holds but chance or noise, as far as balls tell

    def held_by(self, k):
        """Return the k-th motion, (6,), such that it moves a surface by 1 along its normal.

        That which it moves most; and which centres, of the target and of the source, it moves by
        more than half of that: those that hold it.
        """
        along = np.abs(self.along[:, k])
        most = along.max(initial=0.0)
        if most == 0.0:
            return self.motions[:, k], tuple(some[:0] for some in self.centres)
        of_target, of_source = self.centres
        hold = np.flatnonzero(along > HOLDING * most)
        n = int(np.searchsorted(hold, len(of_target)))
        holders = of_target[hold[:n]], of_source[hold[n:] - len(of_target)]
        return self.motions[:, k] / most, holders


def hold_of(joint, T_target_source):
    """Return the `Hold` of a `JointEntropy`'s clouds on one another at a transform.

    Of a sample of the centres; of all, where by the sample a motion may be free.
    """
    hold = _hold(joint, T_target_source, SAMPLE)
    if (hold.strength < LEAST_STRENGTH).any():
        hold = _hold(joint, T_target_source, np.inf)
    return hold


def _hold(joint, T_target_source, sample):
    T, pairs = T_target_source, joint.pairs_at(T_target_source)
    back, r2 = se3.inverse(T), joint.r2
    to_source = se3.adjoint(back)
    *here, x, v, of_target = _planes(joint.target, joint.source, pairs.of_target, T, r2, sample)
    *there, x_there, v_there, of_source = _planes(
        joint.source, joint.target, pairs.of_source, back, r2, sample
    )
    x = np.concatenate([x, se3.transform_points(T, x_there)])
    if len(x) == 0:
        return _without_surfaces(joint, T, (of_target, of_source))
    pivot = x.mean(axis=0)
    scatter = (x - pivot).T @ (x - pivot) / len(x)
    arm = max(float(np.sqrt(np.trace(scatter))), joint.radius)
    units = unit_motions(pivot, _turns(scatter, joint.radius))
    a, b = (
        np.concatenate([j, j_there @ to_source]) @ units
        for j, j_there in zip(here, there, strict=True)
    )
    noise = float(np.concatenate([v, v_there]).mean())
    mean = a.T @ b / len(x)
    strength, axes = np.linalg.eigh((mean + mean.T) / 2)
    along = a @ axes
    products = along * (b @ axes)  # their mean is the strength
    variance = np.einsum('ij,ij->j', products, products) / len(x) - strength**2
    error = np.sqrt(np.maximum(variance, 0.0) / len(x))
    free = _free(strength, error, noise, len(x))
    centres = of_target, of_source
    return Hold(strength, error, noise, units @ axes, units, arm, along, centres, free)


def _free(strength, error, noise, balls):
    if 0 < balls < LEAST_BALLS:
        return np.zeros(6, bool)
    by_chance = np.maximum(CHANCE * error, max(NOISE * noise, ROUNDING))
    too_loose = strength + CHANCE * error < LEAST_STRENGTH
    return (strength < by_chance) & too_loose


def _without_surfaces(joint, T, centres):
    """Return the `Hold` of clouds without surfaces, such as lines, by their stiffness."""
    pivot, arm = middle_and_arm(joint, T)
    units = unit_motions(pivot, np.eye(3) / arm)
    _, matrix = joint.linearize(T)
    stiffness, axes = np.linalg.eigh(units.T @ matrix @ units)
    strength = stiffness / stiffness[-1] if stiffness[-1] > 0.0 else np.ones(6)
    error, along = np.zeros(6), np.empty((0, 6))
    free = _free(strength, error, 0.0, 0)
    return Hold(strength, error, 0.0, units @ axes, units, arm, along, centres, free)


def unit_motions(pivot, turns):
    """Return (6, 6): columns (omega, v) that turn about a pivot by turns (3, 3), or move by 1."""
    units = np.eye(6)
    units[:3, :3] = turns
    units[3:, :3] = se3.skew(pivot) @ turns
    return units


def _turns(scatter, least):
    """Return (3, 3) rotations that move points of a (3, 3) scatter by 1, root mean square.

    A corridor is turned farther about its axis than across it: its walls are near to that axis.
    """
    squares, axes = np.linalg.eigh(np.trace(scatter) * np.eye(3) - scatter)
    return axes / np.sqrt(np.maximum(squares, least**2)) @ axes.T


def middle_and_arm(joint, T_target_source):
    """Return the source's middle in the target's frame, (3,), and how far its points are from it.

    Between the clouds' origins; the arm is a root mean square, and a radius at least.
    """
    middle, square = _mean_and_variance(joint.source.grid.points)
    return se3.transform_points(T_target_source, middle), max(np.sqrt(square), joint.radius)


@kernel
def _mean_and_variance(points):
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


def _planes(centres, others, candidates, T, r2, sample):
    """Return what `_fill_planes` finds in balls of a cloud: j of either plane, x, v and centre."""
    stride = max(len(centres.order) // sample, 1)
    most = len(centres.order) // stride + 1
    a, b, x, v = np.empty((most, 6)), np.empty((most, 6)), np.empty((most, 3)), np.empty(most)
    chosen = np.empty(most, np.int64)
    own = (centres.grid.points, centres.raw_own)
    around = (others.grid.points, others.raw, *candidates, *se3.rotation_and_translation(T))
    n = _fill_planes(*own, *around, r2, stride, a, b, x, v, chosen)
    return a[:n], b[:n], x[:n], v[:n], chosen[:n]


@kernel
def _fill_planes(
    centres, own, points, raw, first, member, R, t, r2, stride, ja, jb, at, v, chosen
):
    """Fill j = (x times n, n) of either cloud in every stride-th centre's ball; return how many.

    x and n are mean and normal of a cloud's points in the ball; the normals' signs are alike. v is
    the variance of a normal, the two clouds' geometric mean.
    """
    n = 0
    for i in range(0, centres.shape[0], stride):
        if own[i, 0] < LEAST_MEMBERS or first[i + 1] == first[i]:
            continue
        x, y, z = into_frame(centres[i], R, t)
        if raw.shape[0] > 0:
            m = raw_moments(x, y, z, points, raw, member, first[i], first[i + 1], r2)
        else:
            m = unit_moments(x, y, z, points, member, first[i], first[i + 1], r2)
        if m[0] < LEAST_MEMBERS:
            continue
        a, b = row_of(own, i), rotated(R, m)
        va, na = _normal(covariance(a))
        vb, nb = _normal(covariance(b))
        if va < 0.0 or vb < 0.0:
            continue
        v[n] = np.sqrt(va / a[0] * vb / b[0])
        p = centres[i]
        xa = (p[0] + a[1] / a[0], p[1] + a[2] / a[0], p[2] + a[3] / a[0])
        xb = (p[0] + b[1] / b[0], p[1] + b[2] / b[0], p[2] + b[3] / b[0])
        sign = 1.0 if na[0] * nb[0] + na[1] * nb[1] + na[2] * nb[2] >= 0.0 else -1.0
        _fill(ja[n], xa, na, 1.0)
        _fill(jb[n], xb, nb, sign)
        at[n, 0], at[n, 1], at[n, 2] = xa
        chosen[n] = i
        n += 1
    return n


@kernel
def _normal(s):
    """Return first variance over second, and the first's axis: the normal of a surface.

    -1 where a covariance is no surface's. The variance of a normal is this over the members.
    The adjugate's widest axis is the normal; squaring it leaves little of the others.
    """
    xx, xy, xz, yy, yz, zz = s
    spread = xx + yy + zz
    n = (
        yy * zz - yz * yz,
        xz * yz - xy * zz,
        xy * yz - xz * yy,
        xx * zz - xz * xz,
        xy * xz - xx * yz,
        xx * yy - xy * xy,
    )
    minors = n[0] + n[3] + n[5]
    if not (minors > 0.0 and FLAT * determinant(s) * spread < minors * minors):
        return -1.0, (0.0, 0.0, 0.0)
    for _ in range(SQUARINGS):
        n = _squared(n)
    if n[0] >= n[3] and n[0] >= n[5]:
        column = (n[0], n[1], n[2])
    elif n[3] >= n[5]:
        column = (n[1], n[3], n[4])
    else:
        column = (n[2], n[4], n[5])
    f = 1.0 / np.sqrt(column[0] ** 2 + column[1] ** 2 + column[2] ** 2)
    flatness = max(determinant(s), 0.0) * spread / (minors * minors)
    return flatness, (column[0] * f, column[1] * f, column[2] * f)


@kernel
def _squared(n):
    """Return N N over its trace, N symmetric."""
    xx, xy, xz, yy, yz, zz = n
    a, d, f = xx * xx + xy * xy + xz * xz, xy * xy + yy * yy + yz * yz, xz * xz + yz * yz + zz * zz
    b, c, e = xx * xy + xy * yy + xz * yz, xx * xz + xy * yz + xz * zz, xy * xz + yy * yz + yz * zz
    g = 1.0 / (a + d + f)
    return (a * g, b * g, c * g, d * g, e * g, f * g)


@kernel
def _fill(j, x, n, sign):
    j[0] = sign * (x[1] * n[2] - x[2] * n[1])
    j[1] = sign * (x[2] * n[0] - x[0] * n[2])
    j[2] = sign * (x[0] * n[1] - x[1] * n[0])
    j[3], j[4], j[5] = sign * n[0], sign * n[1], sign * n[2]
