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
    row_of,
    unit_moments,
)
from idem_ros.core.se3 import adjoint_of

# One block's sums: gradient (omega, v), then of the matrix vv (6), omega-v (9), omega-omega (6).
SUMS = 27
BALANCED = 0.35  # of the radius, between the means of a ball's two clouds
MOST_BEND = 2.0
IN_ONE = np.empty(0, np.int64)  # all centres are of the first group


@njit(**JIT)
def linearize(
    centres,
    own,
    points,
    raw,
    first,
    member,
    R,
    t,
    r2,
    scale,
    noise,
    slide,
    level,
    chosen,
    group,
    sums,
):
    """Add gradient and Gauss-Newton matrix over centres begin, begin + stride, ... < end to sums.

    chosen: (begin, end, stride). sums (G, 27): of each group; group (N,): which one each centre is
    in, or (0,): all are in the first.

    The twist moves the other cloud, points and raw, whose frame R, t take to that of the centres;
    candidates of centre i: member[first[i]:first[i + 1]]. The variance of noise is added to every
    axis of every covariance. slide: leave out the pull along the surface, `_along_thinnest`; among
    raw points each ball counts by its `_balance`. level: see `_bend`.
    """
    c = TWO_PI_E_CUBED / scale**6
    for i in range(*chosen):
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
        joint = plus(row_of(own, i), cross)
        if joint[0] <= MOST_WITHOUT_ENTROPY:
            continue
        xx, xy, xz, yy, yz, zz = covariance(joint)
        sigma = (xx + noise, xy, xz, yy + noise, yz, zz + noise)
        det = determinant(sigma)
        if det > 0.0:
            rho = c * det / (1.0 + c * det)
            w = _inverse(sigma, det)
            if slide:
                w = _along_thinnest(w)
                if raw.shape[0] > 0:
                    rho *= _balance(joint, cross, r2)
            g = group[i] if group.shape[0] > 0 else 0
            bend = _bend(joint, cross) if level else 0.0
            _add_centre(centres[i], cross, joint, w, rho, bend, g, sums)


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
def _along_thinnest(w):
    """Return W^3 / tr(W)^2: each axis of S by the square of its share of the pull.

    Along the surface the two clouds' means differ by where either happens to end or to be sampled,
    not by a misalignment: rings of a LiDAR would draw each other together.
    """
    square = _product(w, w)
    trace = w[0] + w[3] + w[5]
    xx, xy, xz, yy, yz, zz = _product(square, w)
    f = 1.0 / (trace * trace)
    return xx * f, xy * f, xz * f, yy * f, yz * f, zz * f


@njit(**JIT)
def _balance(joint, cross, r2):
    """Return 1 / (1 + (d / (BALANCED r))^4) for means of the ball's two clouds that are d apart.

    Far apart they are two rings, or two sides of the overlap's rim: their difference is then more
    of the surface's shape than of a misalignment. Few points lie apart by chance, many do not.
    """
    n = joint[0] - cross[0]
    x = cross[1] / cross[0] - (joint[1] - cross[1]) / n
    y = cross[2] / cross[0] - (joint[2] - cross[2]) / n
    z = cross[3] / cross[0] - (joint[3] - cross[3]) / n
    apart = (x * x + y * y + z * z) / (BALANCED * BALANCED * r2)
    return 1.0 / (1.0 + apart * apart)


@njit(**JIT)
def _bend(joint, cross):
    """Return by how much more the other cloud's points spread about the centre, less 1.

    A surface bends away from its tangent by as much as points spread along it: the mean of own
    points, times this, lies that much too near. The centre is one of them, and others of an even
    sampling keep off it. Of two samplings alike the one cloud's balls make up for the other's.
    """
    others = cross[4] + cross[7] + cross[9]
    own = joint[4] + joint[7] + joint[9] - others
    if own <= 0.0:
        return 0.0
    more = others / cross[0] * (joint[0] - cross[0]) / own
    return min(max(more, 1.0 / MOST_BEND), MOST_BEND) - 1.0


@njit(**JIT)
def _product(a, b):
    """Return the product of two symmetric matrices of the same axes, symmetric too."""
    axx, axy, axz, ayy, ayz, azz = a
    bxx, bxy, bxz, byy, byz, bzz = b
    return (
        axx * bxx + axy * bxy + axz * bxz,
        axx * bxy + axy * byy + axz * byz,
        axx * bxz + axy * byz + axz * bzz,
        axy * bxy + ayy * byy + ayz * byz,
        axy * bxz + ayy * byz + ayz * bzz,
        axz * bxz + ayz * byz + azz * bzz,
    )


@njit(**JIT)
def _times(w, x, y, z):
    xx, xy, xz, yy, yz, zz = w
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


@njit(**JIT)
def _add_centre(p, cross, joint, w, rho, bend, g, sums):
    """Add one centre's gradient and matrix; the sums of a ball are relative to its centre p.

    bend: own points count as this much farther from the centre.
    """
    n, sx, sy, sz, xx, xy, xz, yy, yz, zz = cross
    k = joint[0]
    mx = (joint[1] + bend * (joint[1] - sx)) / k
    my = (joint[2] + bend * (joint[2] - sy)) / k
    mz = (joint[3] + bend * (joint[3] - sz)) / k
    f = rho / k
    # v: W sum(x_l - m)
    bx, by, bz = _times(w, sx - n * mx, sy - n * my, sz - n * mz)
    # omega: sum x_l x W (x_l - m) = p x b + sum d x W d - s x W m
    ux, uy, uz = _times(w, mx, my, mz)
    ax, ay, az = _times(w, xx, xy, xz)  # rows of S W
    cx, cy, cz = _times(w, xy, yy, yz)
    ex, ey, ez = _times(w, xz, yz, zz)
    sums[g, 0] += f * (p[1] * bz - p[2] * by + cz - ey - (sy * uz - sz * uy))
    sums[g, 1] += f * (p[2] * bx - p[0] * bz + ex - az - (sz * ux - sx * uz))
    sums[g, 2] += f * (p[0] * by - p[1] * bx + ay - cx - (sx * uy - sy * ux))
    sums[g, 3] += f * bx
    sums[g, 4] += f * by
    sums[g, 5] += f * bz
    _add_matrix(p[0] + sx / n, p[1] + sy / n, p[2] + sz / n, w, f * n * (1.0 - n / k), g, sums)


@njit(**JIT)
def _add_matrix(x, y, z, w, f, g, sums):
    """Add f J^T W J, J = [-[x]_x, I]: the motion of the moving members' mean."""
    wxx, wxy, wxz, wyy, wyz, wzz = w
    sums[g, 6] += f * wxx
    sums[g, 7] += f * wxy
    sums[g, 8] += f * wxz
    sums[g, 9] += f * wyy
    sums[g, 10] += f * wyz
    sums[g, 11] += f * wzz
    a00, a01, a02 = y * wxz - z * wxy, y * wyz - z * wyy, y * wzz - z * wyz  # [x]_x W
    a10, a11, a12 = z * wxx - x * wxz, z * wxy - x * wyz, z * wxz - x * wzz
    a20, a21, a22 = x * wxy - y * wxx, x * wyy - y * wxy, x * wyz - y * wxz
    sums[g, 12] += f * a00
    sums[g, 13] += f * a01
    sums[g, 14] += f * a02
    sums[g, 15] += f * a10
    sums[g, 16] += f * a11
    sums[g, 17] += f * a12
    sums[g, 18] += f * a20
    sums[g, 19] += f * a21
    sums[g, 20] += f * a22
    sums[g, 21] += f * (a02 * y - a01 * z)  # -[x]_x W [x]_x
    sums[g, 22] += f * (a00 * z - a02 * x)
    sums[g, 23] += f * (a01 * x - a00 * y)
    sums[g, 24] += f * (a10 * z - a12 * x)
    sums[g, 25] += f * (a11 * x - a10 * y)
    sums[g, 26] += f * (a21 * x - a20 * y)


def _places():
    """Return where in the sums each entry of the matrix is, (6, 6)."""
    place = np.empty((6, 6), int)
    upper = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
    place[3:, 3:], place[:3, :3] = 6 + upper, 21 + upper
    place[:3, 3:] = np.arange(12, 21).reshape(3, 3)
    place[3:, :3] = place[:3, 3:].T
    return place


_MATRIX = _places()


@njit(**JIT)
def of_both(here, there, T_source_target):
    """Return gradients (G, 6) and Gauss-Newton matrices (G, 6, 6) for a twist (omega, v).

    Of the sums (blocks, G, 27) around the target's centres, for a twist on the left of
    T_target_source, and around the source's, for one on the left of its inverse: exp(xi) T has
    the inverse exp(-Ad(T)^-1 xi) T^-1.
    """
    groups = here.shape[1]
    back = adjoint_of(T_source_target)
    pulls, stiffness = np.zeros((groups, 6)), np.zeros((groups, 6, 6))
    pull, matrix, product = np.empty(6), np.empty((6, 6)), np.empty((6, 6))
    for g in range(groups):
        if not (here[:, g].any() or there[:, g].any()):
            continue
        _unpack(there[:, g], pull, matrix)
        _unpack(here[:, g], pulls[g], stiffness[g])
        for i in range(6):
            for j in range(6):
                pulls[g, i] -= back[j, i] * pull[j]
                product[i, j] = 0.0
                for k in range(6):
                    product[i, j] += matrix[i, k] * back[k, j]
        for i in range(6):
            for j in range(6):
                for k in range(6):
                    stiffness[g, i, j] += back[k, i] * product[k, j]
    return pulls, stiffness


@njit(**JIT)
def _unpack(sums, pull, matrix):
    """Fill gradient (6,) and matrix (6, 6) with the sum of rows (blocks, 27)."""
    for i in range(6):
        pull[i] = 0.0
        for b in range(sums.shape[0]):
            pull[i] += sums[b, i]
        for j in range(6):
            matrix[i, j] = 0.0
            for b in range(sums.shape[0]):
                matrix[i, j] += sums[b, _MATRIX[i, j]]
