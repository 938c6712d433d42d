"""Moments of a ball: the weight of its members, and the sums of d and d d^T about its centre.

A point of a cloud has a weight and a scatter: one and none where it is a point as measured, those
of the points that it stands for where it is a voxel's mean. Ten numbers are a ball's moments:
(k, s, S) = (sum w, sum w d, sum w d d^T + scatter), S as (xx, xy, xz, yy, yz, zz).
"""

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Indices,
    Integer,
    MomentRows,
    Moments,
    Point,
    Points,
    RotationMatrix,
    Symmetric,
    Triple,
    Weights,
)
from idem_ros.core.geometry import symmetric3
from idem_ros.core.geometry.grid import Grid, neighbours, room_for
from idem_ros.core.jit import inlined, kernel

# A pair at exactly r (points on a lattice) must not be decided by the last bit.
TIE = 1.0 + 1e-12
AS_MEASURED = np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])  # weight and scatter of all points


@inlined
def ball_moments(
    p: Triple,
    points: Points,
    weights: Weights,
    member: Indices,
    begin: Integer,
    end: Integer,
    r2: float,
) -> tuple[Moments, Moments]:
    """Return two sums of 1, d and d d^T, d = point - p, over the members within sqrt(r2) of p.

    The first with each point counting once, the second with weight and scatter; of the one that a
    kernel leaves aside the compiler leaves out the work.

    weights (N, 7): weight and scatter of each point, or (1, 7): of all of them.
    begin, end: unsigned, so that no index is looked at whether it is negative.
    """
    px, py, pz = p
    each = np.uint64(weights.shape[0] > 1)
    n = ux = uy = uz = uxx = uxy = uxz = uyy = uyz = uzz = 0.0
    k = sx = sy = sz = xx = xy = xz = yy = yz = zz = 0.0
    for c in range(begin, end):
        j = np.uint64(member[c])
        dx, dy, dz = points[j, 0] - px, points[j, 1] - py, points[j, 2] - pz
        if dx * dx + dy * dy + dz * dz > r2:
            continue
        n += 1.0
        ux += dx
        uy += dy
        uz += dz
        uxx += dx * dx
        uxy += dx * dy
        uxz += dx * dz
        uyy += dy * dy
        uyz += dy * dz
        uzz += dz * dz
        row = j * each
        w = weights[row, 0]
        wx, wy, wz = w * dx, w * dy, w * dz
        k += w
        sx += wx
        sy += wy
        sz += wz
        xx += wx * dx + weights[row, 1]
        xy += wx * dy + weights[row, 2]
        xz += wx * dz + weights[row, 3]
        yy += wy * dy + weights[row, 4]
        yz += wy * dz + weights[row, 5]
        zz += wz * dz + weights[row, 6]
    unit = (n, ux, uy, uz, uxx, uxy, uxz, uyy, uyz, uzz)
    return unit, (k, sx, sy, sz, xx, xy, xz, yy, yz, zz)


@kernel
def moments_around(
    centres: Points, grid: Grid, weights: Weights, r2: float, unit: MomentRows, own: MomentRows
) -> None:
    """Fill both moments (N, 10) of balls around centres (N, 3), of a grid's points.

    The grid's weights are in its order.
    """
    found, rows = room_for(grid)
    for i in range(centres.shape[0]):
        p = point_of(centres, i)
        n = neighbours(p[0], p[1], p[2], grid, r2, found, rows)
        once, m = ball_moments(p, grid.points, weights, found, np.uint64(0), n, r2)
        for c in range(10):
            unit[i, c] = once[c]
            own[i, c] = m[c]


@inlined
def covariance(moments: Moments) -> Symmetric:
    """Return the covariance, divided by k, of moments (k, s, S): S/k - (s/k)(s/k)^T."""
    k, sx, sy, sz, xx, xy, xz, yy, yz, zz = moments
    inverse = 1.0 / k
    mx, my, mz = sx * inverse, sy * inverse, sz * inverse
    return (
        xx * inverse - mx * mx,
        xy * inverse - mx * my,
        xz * inverse - mx * mz,
        yy * inverse - my * my,
        yz * inverse - my * mz,
        zz * inverse - mz * mz,
    )


@inlined
def point_of(points: Points, i: Integer) -> Triple:
    """Return row i of points (N, 3)."""
    return points[i, 0], points[i, 1], points[i, 2]


@inlined
def row_of(m: MomentRows, i: Integer) -> Moments:
    """Return row i of moments (N, 10)."""
    a, b = m[i], m[i, 5:]
    return a[0], a[1], a[2], a[3], a[4], b[0], b[1], b[2], b[3], b[4]


@inlined
def plus(a: Moments, b: Moments) -> Moments:
    """Return the sum of two moments about the same centre."""
    return (
        *(a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4]),
        *(a[5] + b[5], a[6] + b[6], a[7] + b[7], a[8] + b[8], a[9] + b[9]),
    )


@inlined
def into_frame(p: Triple, R: RotationMatrix, t: Point) -> Triple:
    """Return R^T (p - t): a centre, taken to the frame in which the other cloud stays."""
    x, y, z = p[0] - t[0], p[1] - t[1], p[2] - t[2]
    return (
        R[0, 0] * x + R[1, 0] * y + R[2, 0] * z,
        R[0, 1] * x + R[1, 1] * y + R[2, 1] * z,
        R[0, 2] * x + R[1, 2] * y + R[2, 2] * z,
    )


@kernel
def turned_weights(R: RotationMatrix, weights: Weights) -> Weights:
    """Return weights and scatters (N, 7) of points that were turned."""
    turned = np.empty(weights.shape)
    for i in range(weights.shape[0]):
        w = weights[i]
        scatter = symmetric3.rotated(R, (w[1], w[2], w[3], w[4], w[5], w[6]))
        turned[i, 0] = w[0]
        for a in range(6):
            turned[i, 1 + a] = scatter[a]
    return turned


@inlined
def rotated(R: RotationMatrix, m: Moments) -> Moments:
    """Return moments m of the other cloud with the axes of the centre's frame: R s, R S R^T."""
    k, sx, sy, sz, xx, xy, xz, yy, yz, zz = m
    return (
        k,
        R[0, 0] * sx + R[0, 1] * sy + R[0, 2] * sz,
        R[1, 0] * sx + R[1, 1] * sy + R[1, 2] * sz,
        R[2, 0] * sx + R[2, 1] * sy + R[2, 2] * sz,
        *symmetric3.rotated(R, (xx, xy, xz, yy, yz, zz)),
    )


@inlined
def add_member(m: Floats, d: Triple, sign: float) -> None:
    """Add a point at d from the centre to moments (10,); sign -1: the centre as seen from it."""
    dx, dy, dz = d
    m[0] += 1.0
    m[1] += sign * dx
    m[2] += sign * dy
    m[3] += sign * dz
    m[4] += dx * dx
    m[5] += dx * dy
    m[6] += dx * dz
    m[7] += dy * dy
    m[8] += dy * dz
    m[9] += dz * dz
