"""Moments of a ball, how many points and the sums of d and d d^T about its centre; entropy."""

import numpy as np

from idem_ros.core.grid import neighbours, room_for
from idem_ros.core.jit import kernel

TWO_PI_E_CUBED = (2.0 * np.pi * np.e) ** 3  # (2 pi e)^N of Eq. 4 in three dimensions
# A pair at exactly r (points on a lattice) must not be decided by the last bit.
TIE = 1.0 + 1e-12
MOST_WITHOUT_ENTROPY = 3  # k <= 3 points lie in a plane: no entropy (after Eq. 4)


@kernel
def unit_moments(px, py, pz, points, member, begin, end, r2):
    """Sum 1, d and d d^T, d = point - p, over those members within sqrt(r2) of p.

    Returns (k, dx, dy, dz, xx, xy, xz, yy, yz, zz).
    """
    k = sx = sy = sz = xx = xy = xz = yy = yz = zz = 0.0
    for c in range(np.uint64(begin), np.uint64(end)):  # unsigned: no look at negative indices
        j = np.uint64(member[c])
        dx, dy, dz = points[j, 0] - px, points[j, 1] - py, points[j, 2] - pz
        if dx * dx + dy * dy + dz * dz > r2:
            continue
        k += 1.0
        sx += dx
        sy += dy
        sz += dz
        xx += dx * dx
        xy += dx * dy
        xz += dx * dz
        yy += dy * dy
        yz += dy * dz
        zz += dz * dz
    return (k, sx, sy, sz, xx, xy, xz, yy, yz, zz)


@kernel
def raw_moments(px, py, pz, points, raw, member, begin, end, r2):
    """Sum the same over the raw points that the members stand for.

    raw (N, 7): how many points each stands for, and their scatter about it (xx, xy, ..., zz).
    """
    k = sx = sy = sz = xx = xy = xz = yy = yz = zz = 0.0
    for c in range(np.uint64(begin), np.uint64(end)):  # unsigned: no look at negative indices
        j = np.uint64(member[c])
        dx, dy, dz = points[j, 0] - px, points[j, 1] - py, points[j, 2] - pz
        if dx * dx + dy * dy + dz * dz > r2:
            continue
        w = raw[j, 0]
        wx, wy, wz = w * dx, w * dy, w * dz
        k += w
        sx += wx
        sy += wy
        sz += wz
        xx += wx * dx + raw[j, 1]
        xy += wx * dy + raw[j, 2]
        xz += wx * dz + raw[j, 3]
        yy += wy * dy + raw[j, 4]
        yz += wy * dz + raw[j, 5]
        zz += wz * dz + raw[j, 6]
    return (k, sx, sy, sz, xx, xy, xz, yy, yz, zz)


@kernel
def own_moments(grid, raw, r2, scale, begin, end, stride, unit_own, raw_own, h):
    """Fill rows [begin, end) of moments (N, 10) and entropy h (N,) within their own cloud.

    Row i is of point i * stride. raw_own is left alone where raw is empty: every point then stands
    for itself.
    """
    points = grid.points
    found, rows = room_for(grid)
    for i in range(begin, end):
        p = points[i * stride]
        px, py, pz = p[0], p[1], p[2]
        n = neighbours(px, py, pz, grid, r2, found, rows)
        if raw.shape[0] > 0:
            m, w = _both_moments(px, py, pz, points, raw, found, n)
            for c in range(10):
                raw_own[i, c] = w[c]
        else:
            m = unit_moments(px, py, pz, points, found, 0, n, r2)
        h[i] = entropy(m, scale)
        for c in range(10):
            unit_own[i, c] = m[c]


@kernel
def _both_moments(px, py, pz, points, raw, found, n):
    """Return what `unit_moments` and `raw_moments` do of the first n found, in one pass."""
    k = sx = sy = sz = xx = xy = xz = yy = yz = zz = 0.0
    rx = ry = rz = rxx = rxy = rxz = ryy = ryz = rzz = 0.0
    for c in range(np.uint64(n)):
        j = np.uint64(found[c])
        dx, dy, dz = points[j, 0] - px, points[j, 1] - py, points[j, 2] - pz
        w = raw[j, 0]
        wx, wy, wz = w * dx, w * dy, w * dz
        k += w
        sx += dx
        sy += dy
        sz += dz
        xx += dx * dx
        xy += dx * dy
        xz += dx * dz
        yy += dy * dy
        yz += dy * dz
        zz += dz * dz
        rx += wx
        ry += wy
        rz += wz
        rxx += wx * dx + raw[j, 1]
        rxy += wx * dy + raw[j, 2]
        rxz += wx * dz + raw[j, 3]
        ryy += wy * dy + raw[j, 4]
        ryz += wy * dz + raw[j, 5]
        rzz += wz * dz + raw[j, 6]
    unit = (np.float64(n), sx, sy, sz, xx, xy, xz, yy, yz, zz)
    return unit, (k, rx, ry, rz, rxx, rxy, rxz, ryy, ryz, rzz)


@kernel
def covariance(moments):
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


@kernel
def determinant(s):
    """Return det of a symmetric matrix (xx, xy, xz, yy, yz, zz)."""
    xx, xy, xz, yy, yz, zz = s
    return xx * (yy * zz - yz * yz) - xy * (xy * zz - xz * yz) + xz * (xy * yz - xz * yy)


@kernel
def entropy(moments, scale):
    """Eq. 4: h = 1/2 ln((2 pi e)^3 det Sigma + 1), lengths divided by the scale."""
    if moments[0] <= MOST_WITHOUT_ENTROPY:
        return 0.0
    det = max(determinant(covariance(moments)), 0.0) / scale**6
    return 0.5 * np.log1p(TWO_PI_E_CUBED * det)


@kernel
def row_of(m, i):
    """Return row i of moments (N, 10)."""
    a, b = m[i], m[i, 5:]
    return a[0], a[1], a[2], a[3], a[4], b[0], b[1], b[2], b[3], b[4]


@kernel
def plus(a, b):
    """Return the sum of two moments."""
    return (
        a[0] + b[0],
        a[1] + b[1],
        a[2] + b[2],
        a[3] + b[3],
        a[4] + b[4],
        a[5] + b[5],
        a[6] + b[6],
        a[7] + b[7],
        a[8] + b[8],
        a[9] + b[9],
    )


@kernel
def into_frame(p, R, t):
    """Return R^T (p - t): a centre, taken to the frame in which the other cloud stays."""
    x, y, z = p[0] - t[0], p[1] - t[1], p[2] - t[2]
    return (
        R[0, 0] * x + R[1, 0] * y + R[2, 0] * z,
        R[0, 1] * x + R[1, 1] * y + R[2, 1] * z,
        R[0, 2] * x + R[1, 2] * y + R[2, 2] * z,
    )


@kernel
def rotated(R, m):
    """Return moments m of the other cloud with the axes of the centre's frame: R s, R S R^T."""
    k, sx, sy, sz, xx, xy, xz, yy, yz, zz = m
    ax, ay, az = _row_times(R[0, 0], R[0, 1], R[0, 2], xx, xy, xz, yy, yz, zz)
    bx, by, bz = _row_times(R[1, 0], R[1, 1], R[1, 2], xx, xy, xz, yy, yz, zz)
    cx, cy, cz = _row_times(R[2, 0], R[2, 1], R[2, 2], xx, xy, xz, yy, yz, zz)
    return (
        k,
        R[0, 0] * sx + R[0, 1] * sy + R[0, 2] * sz,
        R[1, 0] * sx + R[1, 1] * sy + R[1, 2] * sz,
        R[2, 0] * sx + R[2, 1] * sy + R[2, 2] * sz,
        ax * R[0, 0] + ay * R[0, 1] + az * R[0, 2],
        ax * R[1, 0] + ay * R[1, 1] + az * R[1, 2],
        ax * R[2, 0] + ay * R[2, 1] + az * R[2, 2],
        bx * R[1, 0] + by * R[1, 1] + bz * R[1, 2],
        bx * R[2, 0] + by * R[2, 1] + bz * R[2, 2],
        cx * R[2, 0] + cy * R[2, 1] + cz * R[2, 2],
    )


@kernel
def _row_times(a, b, c, xx, xy, xz, yy, yz, zz):
    return a * xx + b * xy + c * xz, a * xy + b * yy + c * yz, a * xz + b * yz + c * zz


@kernel
def entropy_difference(
    centres, own, h_own, points, first, member, R, t, r2, scale, begin, end, q, reach
):
    """Eq. 7 for one cloud's centres: q_i = h_joint - h_own, and the other's points in reach.

    Candidates of centre i: member[first[i]:first[i + 1]], indices into the other's points.
    """
    for i in range(begin, end):
        x, y, z = into_frame(centres[i], R, t)
        m = unit_moments(x, y, z, points, member, first[i], first[i + 1], r2)
        reach[i] = m[0]
        q[i] = (
            entropy(plus(row_of(own, i), rotated(R, m)), scale) - h_own[i] if m[0] > 0.0 else 0.0
        )
