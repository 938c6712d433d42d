"""The difference of entropies, linearised in a small motion of the other cloud.

With the members of every ball held, dh = (rho / k) sum_l (x_l - m)^T W (v + omega x x_l) over the
members l that move, W = Sigma^-1 and rho = c det Sigma / (1 + c det Sigma). The concave log det is
majorised at Sigma, which leaves rho k_B (1 - k_B / k) / k J^T W J as the Gauss-Newton matrix.
"""

import numpy as np

from idem_ros.core.ball_weights import along_thinnest, balance, bend, inverse
from idem_ros.core.jit import kernel
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
from idem_ros.core.se3 import adjoint_of

# One block's sums: gradient (omega, v), then of the matrix vv (6), omega-v (9), omega-omega (6).
SUMS = 27
IN_ONE = np.empty(0, np.int64)  # all centres are of the first group
# Balls are added so many at a time, each number of theirs in a row with that of the others: the
# compiler then works on four or eight balls at once.
TOGETHER = 128
OWN, OTHER, ROWS = 3, 13, 23  # after the centre: moments of its own cloud, of the other
SIX, NINE = (0.0,) * 6, (0.0,) * 9


@kernel
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
    """Add gradient and Gauss-Newton matrix over the chosen centres to sums.

    chosen (K,): their indices. sums (G, 27): of each group; group (N,): which one each centre is
    in, or (0,): all are in the first. The fewer times it changes along the chosen, the faster.

    The twist moves the other cloud, points and raw, whose frame R, t take to that of the centres;
    candidates of centre i: member[first[i]:first[i + 1]]. The variance of noise is added to every
    axis of every covariance. slide: leave out the pull along the surface, `along_thinnest`; among
    raw points each ball counts by its `balance`. level: see `bend`.
    """
    size = (TWO_PI_E_CUBED / scale**6, r2, noise, slide, slide and raw.shape[0] > 0, level)
    balls, n, g = np.empty((ROWS, TOGETHER)), np.int64(0), np.int64(0)
    for i in chosen:
        if first[i] == first[i + 1]:
            continue
        x, y, z = into_frame(centres[i], R, t)
        if raw.shape[0] > 0:
            m = raw_moments(x, y, z, points, raw, member, first[i], first[i + 1], r2)
        else:
            m = unit_moments(x, y, z, points, member, first[i], first[i + 1], r2)
        if m[0] == 0.0 or own[i, 0] + m[0] <= MOST_WITHOUT_ENTROPY:
            continue
        its = group[i] if group.shape[0] > 0 else 0
        if n == TOGETHER or its != g:
            _add(balls, n, R, size, sums[g])
            n, g = np.int64(0), its
        _put(balls, n, centres[i], own[i], m)
        n += 1
    _add(balls, n, R, size, sums[g])


@kernel
def _put(balls, n, p, own, m):
    for c in range(3):
        balls[c, n] = p[c]
    for c in range(10):
        balls[OWN + c, n] = own[c]
    k, sx, sy, sz, xx, xy, xz, yy, yz, zz = m
    balls[13, n], balls[14, n], balls[15, n], balls[16, n] = k, sx, sy, sz
    balls[17, n], balls[18, n], balls[19, n] = xx, xy, xz
    balls[20, n], balls[21, n], balls[22, n] = yy, yz, zz


@kernel
def _add(balls, n, R, size, sums):
    """Add the first n balls' gradient and matrix to sums (27,)."""
    c, r2, noise, slide, is_balanced, level = size
    pull, vv, wv, ww = SIX, SIX, NINE, SIX
    for i in range(np.uint64(n)):
        cross = rotated(R, _moments_of(balls[OTHER:], i))
        joint = plus(_moments_of(balls[OWN:], i), cross)
        xx, xy, xz, yy, yz, zz = covariance(joint)
        sigma = (xx + noise, xy, xz, yy + noise, yz, zz + noise)
        det = determinant(sigma)
        if det > 0.0:
            w = inverse(sigma, det)
            f = c * det / (1.0 + c * det) / joint[0]  # rho / k
            if slide:
                w = along_thinnest(w)
            if is_balanced:
                f *= balance(joint, cross, r2)
            more = bend(joint, cross) if level else 0.0
            x, y, z = balls[0, i], balls[1, i], balls[2, i]
            pull = _plus6(pull, _pull(x, y, z, cross, joint, w, f, more))
            n_B = cross[0]
            x, y, z = x + cross[1] / n_B, y + cross[2] / n_B, z + cross[3] / n_B
            f *= n_B * (1.0 - n_B / joint[0])
            vv = _plus6(vv, _scaled(w, f))
            wv = _plus9(wv, _turning(x, y, z, w, f))
            ww = _plus6(ww, _turned(x, y, z, w, f))
    _write(sums, pull, vv, wv, ww)


@kernel
def _moments_of(rows, i):
    return (
        *(rows[0, i], rows[1, i], rows[2, i], rows[3, i], rows[4, i]),
        *(rows[5, i], rows[6, i], rows[7, i], rows[8, i], rows[9, i]),
    )


@kernel
def _pull(px, py, pz, cross, joint, w, f, more):
    """Return one centre's gradient (omega, v); the sums of a ball are relative to its centre p.

    more: own points count as this much farther from the centre.
    """
    n, sx, sy, sz, xx, xy, xz, yy, yz, zz = cross
    k = joint[0]
    mx = (joint[1] + more * (joint[1] - sx)) / k
    my = (joint[2] + more * (joint[2] - sy)) / k
    mz = (joint[3] + more * (joint[3] - sz)) / k
    # v: W sum(x_l - m)
    bx, by, bz = _times(w, sx - n * mx, sy - n * my, sz - n * mz)
    # omega: sum x_l x W (x_l - m) = p x b + sum d x W d - s x W m
    ux, uy, uz = _times(w, mx, my, mz)
    ax, ay, az = _times(w, xx, xy, xz)  # rows of S W
    cx, cy, cz = _times(w, xy, yy, yz)
    ex, ey, ez = _times(w, xz, yz, zz)
    return (
        f * (py * bz - pz * by + cz - ey - (sy * uz - sz * uy)),
        f * (pz * bx - px * bz + ex - az - (sz * ux - sx * uz)),
        f * (px * by - py * bx + ay - cx - (sx * uy - sy * ux)),
        f * bx,
        f * by,
        f * bz,
    )


@kernel
def _times(w, x, y, z):
    xx, xy, xz, yy, yz, zz = w
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


@kernel
def _scaled(w, f):
    return w[0] * f, w[1] * f, w[2] * f, w[3] * f, w[4] * f, w[5] * f


@kernel
def _turning(x, y, z, w, f):
    """Return f [x]_x W, of f J^T W J with J = [-[x]_x, I] for the motion of the moving mean x."""
    xx, xy, xz, yy, yz, zz = w
    return (
        *(f * (y * xz - z * xy), f * (y * yz - z * yy), f * (y * zz - z * yz)),
        *(f * (z * xx - x * xz), f * (z * xy - x * yz), f * (z * xz - x * zz)),
        *(f * (x * xy - y * xx), f * (x * yy - y * xy), f * (x * yz - y * xz)),
    )


@kernel
def _turned(x, y, z, w, f):
    """Return the upper half of -f [x]_x W [x]_x."""
    a00, a01, a02, a10, a11, a12, a20, a21, _ = _turning(x, y, z, w, f)
    return (
        *(a02 * y - a01 * z, a00 * z - a02 * x, a01 * x - a00 * y),
        *(a10 * z - a12 * x, a11 * x - a10 * y, a21 * x - a20 * y),
    )


@kernel
def _plus6(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@kernel
def _plus9(a, b):
    return (*_plus6(a[:6], b[:6]), a[6] + b[6], a[7] + b[7], a[8] + b[8])


@kernel
def _write(sums, pull, vv, wv, ww):
    for c in range(6):
        sums[c] += pull[c]
        sums[6 + c] += vv[c]
        sums[21 + c] += ww[c]
    for c in range(9):
        sums[12 + c] += wv[c]


def _places():
    """Return where in the sums each entry of the matrix is, (6, 6)."""
    place = np.empty((6, 6), int)
    upper = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
    place[3:, 3:], place[:3, :3] = 6 + upper, 21 + upper
    place[:3, 3:] = np.arange(12, 21).reshape(3, 3)
    place[3:, :3] = place[:3, 3:].T
    return place


_MATRIX = _places()


@kernel
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


@kernel
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
