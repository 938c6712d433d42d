"""The loops of the metric: moments of a ball, entropy, and the linearised difference."""

import numpy as np
from numba import njit

from idem_ros.core.jit import JIT

TWO_PI_E_CUBED = (2.0 * np.pi * np.e) ** 3  # (2 pi e)^N of Eq. 4 in three dimensions
MOST_WITHOUT_ENTROPY = 3  # k <= 3 points lie in a plane: no entropy (after Eq. 4)
# A pair at exactly r (points on a lattice) must not be decided by the last bit.
TIE = 1.0 + 1e-12
NOTHING = (0.0,) * 10


@njit(**JIT)
def ball_moments(px, py, pz, grid, r):
    """Sum 1, d and d d^T over the grid's points within r of p, d = point - p.

    A point that stands for several counts with its weight and its own scatter.
    Returns (k, dx, dy, dz, xx, xy, xz, yy, yz, zz).
    """
    m = NOTHING
    inverse_cell = 1.0 / grid.cell
    ix = np.int64(np.floor((px - grid.low[0]) * inverse_cell))
    iy = np.int64(np.floor((py - grid.low[1]) * inverse_cell))
    iz = np.int64(np.floor((pz - grid.low[2]) * inverse_cell))
    if ix < -1 or iy < -1 or iz < -1:
        return m
    if ix > grid.extent[0] or iy > grid.extent[1] or iz > grid.extent[2]:
        return m
    r2 = r * r * TIE
    fy = py - grid.low[1] - iy * grid.cell
    fz = pz - grid.low[2] - iz * grid.cell
    mask_x, mask_y, mask_z = _masks(grid.bits)
    first, last = (ix - 1) & mask_x, (ix + 1) & mask_x
    for oz in range(-1, 2):
        gap_z = fz if oz < 0 else (grid.cell - fz if oz > 0 else 0.0)
        for oy in range(-1, 2):
            gap_y = fy if oy < 0 else (grid.cell - fy if oy > 0 else 0.0)
            if gap_y * gap_y + gap_z * gap_z > r2:
                continue
            row = ((((iz + oz) & mask_z) << grid.bits[1]) | ((iy + oy) & mask_y)) << grid.bits[0]
            begin, end = grid.start[row + first], grid.start[row + last + 1]
            if first > last:  # the three cells lie across the end of the period
                m = _plus(m, _run_moments(grid.start[row], end, px, py, pz, grid, r2))
                end = grid.start[row + mask_x + 1]
            m = _plus(m, _run_moments(begin, end, px, py, pz, grid, r2))
    return m


@njit(**JIT)
def _masks(bits):
    return (1 << bits[0]) - 1, (1 << bits[1]) - 1, (1 << bits[2]) - 1


@njit(**JIT)
def _run_moments(begin, end, px, py, pz, grid, r2):
    """Sum moments over a run of the grid's points, of those within r of p."""
    k = sx = sy = sz = xx = xy = xz = yy = yz = zz = 0.0
    points, weight, scatter = grid.points, grid.weight, grid.scatter
    has_scatter = scatter.shape[0] > 0
    for j in range(begin, end):
        dx = points[j, 0] - px
        dy = points[j, 1] - py
        dz = points[j, 2] - pz
        if dx * dx + dy * dy + dz * dz > r2:
            continue
        w = weight[j]
        k += w
        sx += w * dx
        sy += w * dy
        sz += w * dz
        xx += w * dx * dx
        xy += w * dx * dy
        xz += w * dx * dz
        yy += w * dy * dy
        yz += w * dy * dz
        zz += w * dz * dz
        if has_scatter:
            xx += scatter[j, 0]
            xy += scatter[j, 1]
            xz += scatter[j, 2]
            yy += scatter[j, 3]
            yz += scatter[j, 4]
            zz += scatter[j, 5]
    return (k, sx, sy, sz, xx, xy, xz, yy, yz, zz)


@njit(**JIT)
def _plus(a, b):
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


@njit(**JIT)
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


@njit(**JIT)
def determinant(s):
    """Return det of a symmetric matrix (xx, xy, xz, yy, yz, zz)."""
    xx, xy, xz, yy, yz, zz = s
    return xx * (yy * zz - yz * yz) - xy * (xy * zz - xz * yz) + xz * (xy * yz - xz * yy)


@njit(**JIT)
def entropy(moments, scale):
    """Eq. 4: h = 1/2 ln((2 pi e)^3 det Sigma + 1), lengths divided by the scale."""
    if moments[0] <= MOST_WITHOUT_ENTROPY:
        return 0.0
    det = max(determinant(covariance(moments)), 0.0) / scale**6
    return 0.5 * np.log1p(TWO_PI_E_CUBED * det)


@njit(**JIT)
def own_moments(grid, r, scale, moments, h):
    """Fill each point's moments (N, 10) and entropy (N,) within its own cloud."""
    for i in range(grid.points.shape[0]):
        m = ball_moments(grid.points[i, 0], grid.points[i, 1], grid.points[i, 2], grid, r)
        for c in range(10):
            moments[i, c] = m[c]
        h[i] = entropy(m, scale)


@njit(**JIT)
def cross_moments(p, grid, R, t, r):
    """Moments, in the frame of the centre p, of the other cloud's points within r of it.

    R, t take the other cloud's frame, in which its grid stays, to the centre's.
    """
    x, y, z = p[0] - t[0], p[1] - t[1], p[2] - t[2]
    m = ball_moments(
        R[0, 0] * x + R[1, 0] * y + R[2, 0] * z,
        R[0, 1] * x + R[1, 1] * y + R[2, 1] * z,
        R[0, 2] * x + R[1, 2] * y + R[2, 2] * z,
        grid,
        r,
    )
    if m[0] == 0.0:
        return m
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


@njit(**JIT)
def _row_times(a, b, c, xx, xy, xz, yy, yz, zz):
    return a * xx + b * xy + c * xz, a * xy + b * yy + c * yz, a * xz + b * yz + c * zz


@njit(**JIT)
def joined(own, i, cross):
    """Add the own moments of centre i and the moments of the other cloud around it."""
    m = own[i]
    return _plus((m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9]), cross)


@njit(**JIT)
def entropy_difference(centres, own, h_own, grid, R, t, r, scale, q, cross):
    """Eq. 7 for one cloud's centres: q_i = h_joint - h_own, and the other's points in reach."""
    for i in range(centres.shape[0]):
        m = cross_moments(centres[i], grid, R, t, r)
        cross[i] = m[0]
        q[i] = entropy(joined(own, i, m), scale) - h_own[i] if m[0] > 0.0 else 0.0
