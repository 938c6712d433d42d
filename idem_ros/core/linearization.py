"""The difference of entropies, linearised in a small motion of the other cloud.

With the members of every ball held, dh = (rho / k) sum_l (x_l - m)^T W (v + omega x x_l) over the
members l that move, W = Sigma^-1 and rho = c det Sigma / (1 + c det Sigma). The concave log det is
majorised at Sigma, which leaves rho k_B (1 - k_B / k) / k J^T W J as the Gauss-Newton matrix.
"""

import numpy as np
from numba import njit

from idem_ros.core.jit import JIT
from idem_ros.core.moments import (
    MOST_WITHOUT_ENTROPY,
    TWO_PI_E_CUBED,
    covariance,
    determinant,
    into_frame,
    plus,
    raw_moments,
    rotated,
    unit_moments,
)

# One block's sums: gradient (omega, v), then of the matrix vv (6), omega-v (9), omega-omega (6).
SUMS = 27


@njit(**JIT)
def linearize(
    centres, own, points, raw, first, member, R, t, r2, scale, noise, slide, begin, end, sums
):
    """Add gradient and Gauss-Newton matrix over centres [begin, end) to sums (27,).

    The twist moves the other cloud, points and raw, whose frame R, t take to that of the centres;
    candidates of centre i: member[first[i]:first[i + 1]]. The variance of noise is added to every
    axis of every covariance. slide: leave out the pull along the surface, `_without_widest`.
    """
    c = TWO_PI_E_CUBED / scale**6
    for i in range(begin, end):
        if first[i] == first[i + 1]:
            continue
        x, y, z = into_frame(centres[i], R, t)
        if raw.shape[0] > 0:
            m = raw_moments(x, y, z, points, raw, member, first[i], first[i + 1], r2)
        else:
            m = unit_moments(x, y, z, points, member, first[i], first[i + 1], r2)
        if m[0] == 0.0:
            continue
        cross = rotated(R, m)
        joint = plus(own, i, cross)
        if joint[0] <= MOST_WITHOUT_ENTROPY:
            continue
        xx, xy, xz, yy, yz, zz = covariance(joint)
        sigma = (xx + noise, xy, xz, yy + noise, yz, zz + noise)
        det = determinant(sigma)
        if det > 0.0:
            rho = c * det / (1.0 + c * det)
            w = _inverse(sigma, det)
            if slide:
                w = _without_widest(w, sigma)
            _add_centre(centres[i], cross, joint, w, rho, sums)


@njit(**JIT)
def _inverse(s, det):
    xx, xy, xz, yy, yz, zz = s
    f = 1.0 / det
    return (
        (yy * zz - yz * yz) * f,
        (xz * yz - xy * zz) * f,
        (xy * yz - xz * yy) * f,
        (xx * zz - xz * xz) * f,
        (xy * xz - xx * yz) * f,
        (xx * yy - xy * xy) * f,
    )


@njit(**JIT)
def _without_widest(w, s):
    """Return W - I / l: the widest axes of S, along the surface, do not pull; l = tr(SS) / tr(S).

    There the two clouds' means differ by where either happens to end or to be sampled, not by a
    misalignment; at the rim of the overlap that pull is a bias.
    """
    xx, xy, xz, yy, yz, zz = s
    squares = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz)
    u = (xx + yy + zz) / squares
    return (w[0] - u, w[1], w[2], w[3] - u, w[4], w[5] - u)


@njit(**JIT)
def _times(w, x, y, z):
    xx, xy, xz, yy, yz, zz = w
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


@njit(**JIT)
def _add_centre(p, cross, joint, w, rho, sums):
    """Add one centre's gradient and matrix; the sums of a ball are relative to its centre p."""
    n, sx, sy, sz, xx, xy, xz, yy, yz, zz = cross
    k = joint[0]
    mx, my, mz = joint[1] / k, joint[2] / k, joint[3] / k
    f = rho / k
    # v: W sum(x_l - m)
    bx, by, bz = _times(w, sx - n * mx, sy - n * my, sz - n * mz)
    # omega: sum x_l x W (x_l - m) = p x b + sum d x W d - s x W m
    ux, uy, uz = _times(w, mx, my, mz)
    ax, ay, az = _times(w, xx, xy, xz)  # rows of S W
    cx, cy, cz = _times(w, xy, yy, yz)
    ex, ey, ez = _times(w, xz, yz, zz)
    sums[0] += f * (p[1] * bz - p[2] * by + cz - ey - (sy * uz - sz * uy))
    sums[1] += f * (p[2] * bx - p[0] * bz + ex - az - (sz * ux - sx * uz))
    sums[2] += f * (p[0] * by - p[1] * bx + ay - cx - (sx * uy - sy * ux))
    sums[3] += f * bx
    sums[4] += f * by
    sums[5] += f * bz
    _add_matrix(p[0] + sx / n, p[1] + sy / n, p[2] + sz / n, w, f * n * (1.0 - n / k), sums)


@njit(**JIT)
def _add_matrix(x, y, z, w, f, sums):
    """Add f J^T W J, J = [-[x]_x, I]: the motion of the moving members' mean."""
    wxx, wxy, wxz, wyy, wyz, wzz = w
    sums[6] += f * wxx
    sums[7] += f * wxy
    sums[8] += f * wxz
    sums[9] += f * wyy
    sums[10] += f * wyz
    sums[11] += f * wzz
    a00, a01, a02 = y * wxz - z * wxy, y * wyz - z * wyy, y * wzz - z * wyz  # [x]_x W
    a10, a11, a12 = z * wxx - x * wxz, z * wxy - x * wyz, z * wxz - x * wzz
    a20, a21, a22 = x * wxy - y * wxx, x * wyy - y * wxy, x * wyz - y * wxz
    sums[12] += f * a00
    sums[13] += f * a01
    sums[14] += f * a02
    sums[15] += f * a10
    sums[16] += f * a11
    sums[17] += f * a12
    sums[18] += f * a20
    sums[19] += f * a21
    sums[20] += f * a22
    sums[21] += f * (a02 * y - a01 * z)  # -[x]_x W [x]_x
    sums[22] += f * (a00 * z - a02 * x)
    sums[23] += f * (a01 * x - a00 * y)
    sums[24] += f * (a10 * z - a12 * x)
    sums[25] += f * (a11 * x - a10 * y)
    sums[26] += f * (a21 * x - a20 * y)


def unpack(sums):
    """Return gradient (6,) and Gauss-Newton matrix (6, 6), both in the order (omega, v)."""
    matrix = np.empty((6, 6))
    matrix[3:, 3:] = _symmetric(sums[6:12])
    matrix[:3, 3:] = sums[12:21].reshape(3, 3)
    matrix[3:, :3] = matrix[:3, 3:].T
    matrix[:3, :3] = _symmetric(sums[21:27])
    return sums[:6].copy(), matrix


def _symmetric(upper):
    xx, xy, xz, yy, yz, zz = upper
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
