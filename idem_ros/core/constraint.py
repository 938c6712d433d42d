"""Which motions the surfaces of two clouds hold, and which they leave free.

A surface holds a motion along its normal. Normals are known to their noise, which in a plane or a
corridor looks like a little hold in every direction. So each ball takes its normal twice, n_A from
the target's points in it and n_B from the source's: their noises are independent, and the mean of
(n_A . motion)(n_B . motion) over the balls is zero, but for chance, where nothing holds.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from idem_ros.core import se3
from idem_ros.core.jit import JIT
from idem_ros.core.moments import (
    covariance,
    determinant,
    into_frame,
    raw_moments,
    rotated,
    unit_moments,
)

# Planes, corridors, poles and spheres leave at most 0.0015 where they are free; the scenes of
# `idem bench accuracy` hold every motion by 0.009 or more.
LEAST_STRENGTH = 0.002
SAMPLE = 1024  # centres of each cloud, about
LEAST_MEMBERS = 5.0  # of either cloud in a ball: three fix a plane, the others its noise
LEAST_BALLS = 30
FLAT = 4.0  # least second variance of a surface over its first
SQUARINGS = 4  # of a projector on the normal: (1/4)^16 is what they leave of the second axis


class Hold(NamedTuple):
    """How firmly each of six motions is held, the loosest first."""

    strength: np.ndarray  # (6,): mean square of a unit motion along the normals
    motions: np.ndarray  # (6, 6): columns (omega, v) in the frame at the target's origin, each of
    # which moves the surfaces by about 1
    pivot: np.ndarray  # (3,) in that frame: the rotations turn about it
    arm: float  # rotations are by 1 / arm
    balls: int  # that this is known from

    @property
    def free(self):
        """(6,) bool: the motions that nothing holds; none where too few balls could tell."""
        return (self.strength < LEAST_STRENGTH) & (self.balls >= LEAST_BALLS)


def hold_of(joint, T_target_source):
    """Return the `Hold` of a `JointEntropy`'s clouds on one another at a transform."""
    T, pairs = T_target_source, joint.pairs_at(T_target_source)
    back, r2 = se3.inverse(T), joint.r2
    K, x = _strengths(joint.target, joint.source, pairs.of_target, T, r2)
    K_there, x_there = _strengths(joint.source, joint.target, pairs.of_source, back, r2)
    to_source = se3.adjoint(back)
    K += to_source.T @ K_there @ to_source
    x = np.concatenate([x, se3.transform_points(T, x_there)])
    if len(x) == 0:
        return Hold(np.zeros(6), np.eye(6), np.zeros(3), 1.0, 0)
    pivot = x.mean(axis=0)
    arm = max(float(np.sqrt(np.mean(np.sum((x - pivot) ** 2, axis=1)))), joint.radius)
    units = unit_motions(pivot, arm)
    strength, axes = np.linalg.eigh(units.T @ (K + K.T) @ units / (2 * len(x)))
    return Hold(strength, units @ axes, pivot, arm, len(x))


def unit_motions(pivot, arm):
    """Return (6, 6): columns (omega, v) that turn by 1 / arm about a pivot, or move by 1."""
    units = np.eye(6)
    units[:3, :3] /= arm
    units[3:, :3] = se3.skew(pivot) / arm
    return units


def _strengths(centres, others, candidates, T, r2):
    stride = max(len(centres.order) // SAMPLE, 1)
    K, x = np.zeros((6, 6)), np.empty((len(centres.order) // stride + 1, 3))
    own = (centres.grid.points, centres.raw_own)
    R, t = np.ascontiguousarray(T[:3, :3]), T[:3, 3].copy()
    n = _sum(*own, others.grid.points, others.raw, *candidates, R, t, r2, stride, K, x)
    return K, x[:n]


@njit(**JIT)
def _sum(centres, own, points, raw, first, member, R, t, r2, stride, K, at):
    """Add j_A j_B^T, j = (x times n, n), of every stride-th centre's ball to K; return how many.

    x and n are mean and normal of its points of either cloud; `at` takes their means.
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
        a, b = _row(own, i), rotated(R, m)
        flat_a, na = _normal(covariance(a))
        flat_b, nb = _normal(covariance(b))
        if not (flat_a and flat_b):
            continue
        p = centres[i]
        xa = (p[0] + a[1] / a[0], p[1] + a[2] / a[0], p[2] + a[3] / a[0])
        xb = (p[0] + b[1] / b[0], p[1] + b[2] / b[0], p[2] + b[3] / b[0])
        _add_outer(xa, na, xb, nb, K)
        at[n, 0], at[n, 1], at[n, 2] = xa
        n += 1
    return n


@njit(**JIT)
def _row(m, i):
    a, b = m[i], m[i, 5:]
    return a[0], a[1], a[2], a[3], a[4], b[0], b[1], b[2], b[3], b[4]


@njit(**JIT)
def _normal(s):
    """Return whether a covariance is that of a surface, and its normal: the axis of least spread.

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
        return False, (0.0, 0.0, 0.0)
    for _ in range(SQUARINGS):
        n = _squared(n)
    if n[0] >= n[3] and n[0] >= n[5]:
        column = (n[0], n[1], n[2])
    elif n[3] >= n[5]:
        column = (n[1], n[3], n[4])
    else:
        column = (n[2], n[4], n[5])
    f = 1.0 / np.sqrt(column[0] ** 2 + column[1] ** 2 + column[2] ** 2)
    return True, (column[0] * f, column[1] * f, column[2] * f)


@njit(**JIT)
def _squared(n):
    """Return N N over its trace, N symmetric."""
    xx, xy, xz, yy, yz, zz = n
    a, d, f = xx * xx + xy * xy + xz * xz, xy * xy + yy * yy + yz * yz, xz * xz + yz * yz + zz * zz
    b, c, e = xx * xy + xy * yy + xz * yz, xx * xz + xy * yz + xz * zz, xy * xz + yy * yz + yz * zz
    g = 1.0 / (a + d + f)
    return (a * g, b * g, c * g, d * g, e * g, f * g)


@njit(**JIT)
def _add_outer(xa, na, xb, nb, K):
    """Add j_A j_B^T, the normals' signs being alike."""
    sign = 1.0 if na[0] * nb[0] + na[1] * nb[1] + na[2] * nb[2] >= 0.0 else -1.0
    ja, jb = _along(xa, na), _along(xb, nb)
    for r in range(6):
        for c in range(6):
            K[r, c] += sign * ja[r] * jb[c]


@njit(**JIT)
def _along(x, n):
    return (
        x[1] * n[2] - x[2] * n[1],
        x[2] * n[0] - x[0] * n[2],
        x[0] * n[1] - x[1] * n[0],
        n[0],
        n[1],
        n[2],
    )
