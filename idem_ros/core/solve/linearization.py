"""Costs of a ball, and what they are linearised to in a small motion of the other cloud.

With the members of every ball held, dh = (rho / k) sum_l (x_l - m)^T W (v + omega x x_l) over the
members l that move, W = Sigma^-1 and rho = c det Sigma / (1 + c det Sigma). The concave log det is
majorised at Sigma, which leaves rho k_B (1 - k_B / k) / k J^T W J as the Gauss-Newton matrix.
"""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Indices,
    Integer,
    MomentRows,
    Moments,
    RotationMatrix,
    Sides,
    Symmetric,
    Transforms,
    Triple,
)
from idem_ros.core.geometry.se3 import both_ways
from idem_ros.core.geometry.symmetric3 import determinant, inverse, scaled, times
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.metric.entropy import MOST_WITHOUT_ENTROPY
from idem_ros.core.metric.moments import (
    ball_moments,
    covariance,
    into_frame,
    plus,
    point_of,
    rotated,
    row_of,
)
from idem_ros.core.solve.ball_cost import (
    BallCost,
    balance,
    curvature_of,
    own_determinant,
    with_noise,
    without_tangential,
)

# Balls are added so many at a time, each number of theirs in a row with that of the others: the
# compiler then works on four or eight balls at once.
TOGETHER = 128
OWN, OTHER, GAIN, ROWS = 3, 13, 23, 24  # after the centre: moments, and exp(2 q_i)
_Six: TypeAlias = tuple[float, float, float, float, float, float]
_Nine: TypeAlias = tuple[float, float, float, float, float, float, float, float, float]
SIX: _Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
NINE: _Nine = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

NOT_MET: tuple[MomentRows, MomentRows] = (np.empty((0, 10)), np.empty((0, 10)))


@kernel
def linearize(
    sides: Sides,
    met: Sequence[MomentRows],
    transforms: Transforms,
    cost: BallCost,
    chosen: Sequence[Indices],
    group: Sequence[Indices],
    sums: Sequence[Floats],
) -> None:
    """Add value, gradient and Gauss-Newton matrix over the chosen centres of both clouds to sums.

    The value, where it is asked for, is sum h(Sigma) - h(Sigma of own members), h as in Eq. 4,
    over the balls that hold points of both clouds.

    Args:
        sides: of `Balls.sides`; a twist moves the members.
        met: (N, 10) moments of the other cloud's points in each ball, in its own frame, of the
            target's centres and of the source's; `NOT_MET`: they are added up here.
        transforms: (K, 4, 4) T_target_source, at each of which they are added up.
        cost: `BallCost`.
        chosen: (n,) indices of centres, of the target and of the source.
        group: (N,) which group each centre is in, likewise. The fewer times it changes along the
            chosen, the faster.
        sums: (K, G, 28), of each transform and group, likewise.
    """
    balls = np.empty((ROWS, TOGETHER))
    for at in range(len(transforms)):
        turns, ways = both_ways(transforms[at])
        for s in range(2):
            (centres, own), (points, weights, first, member) = sides[s]
            R, t, its_met = turns[s], ways[s], met[s]
            its_group, its_sums = group[s], sums[s][at]
            n, g = np.int64(0), np.int64(0)
            i: int
            for i in chosen[s]:
                p = point_of(centres, i)
                if len(its_met) > 0:
                    m = row_of(its_met, i)
                elif first[i] == first[i + 1]:
                    continue
                else:
                    x = into_frame(p, R, t)
                    begin, end = np.uint64(first[i]), np.uint64(first[i + 1])
                    _, m = ball_moments(x, points, weights, member, begin, end, cost.r2)
                if m[0] == 0.0 or own[i, 0] + m[0] <= MOST_WITHOUT_ENTROPY:
                    continue
                if n == TOGETHER or its_group[i] != g:
                    _add(balls, n, R, cost, its_sums[g])
                    n, g = np.int64(0), its_group[i]
                _put(balls, n, p, own[i], m)
                n += 1
            _add(balls, n, R, cost, its_sums[g])


@inlined
def _put(balls: Floats, n: Integer, p: Triple, own: Floats, m: Moments) -> None:
    balls[0, n], balls[1, n], balls[2, n] = p
    for c in range(10):
        balls[OWN + c, n] = own[c]
    k, sx, sy, sz, xx, xy, xz, yy, yz, zz = m
    balls[13, n], balls[14, n], balls[15, n], balls[16, n] = k, sx, sy, sz
    balls[17, n], balls[18, n], balls[19, n] = xx, xy, xz
    balls[20, n], balls[21, n], balls[22, n] = yy, yz, zz


@inlined
def _add(balls: Floats, n: Integer, R: RotationMatrix, cost: BallCost, sums: Floats) -> None:
    """Add the first n balls' value, gradient and matrix to sums (28,)."""
    if n == 0:  # not even nothing is added: the row may be another thread's
        return
    pull, vv, wv, ww = SIX, SIX, NINE, SIX
    for i in range(np.uint64(n)):
        cross = rotated(R, _moments_of(balls[OTHER:], i))
        own = _moments_of(balls[OWN:], i)
        joint = plus(own, cross)
        sigma = with_noise(covariance(joint), cost.noise)
        det = determinant(sigma)
        if cost.valued:
            gain = (1.0 + cost.c * max(det, 0.0)) / (
                1.0 + cost.c * own_determinant(own, cost.noise)
            )
            balls[GAIN, i] = gain
        if det > 0.0:
            w = inverse(sigma, det)
            f = cost.c * det / (1.0 + cost.c * det) / joint[0]  # rho / k
            if cost.tangential:
                w = without_tangential(w)
                f *= balance(joint, cross, cost.apart2)
            p = balls[0, i], balls[1, i], balls[2, i]
            more = curvature_of(joint, cross, cost.curvature) if cost.curvature > 1.0 else 0.0
            pull = _plus6(pull, pull_of(p, cross, joint, w, f, more))
            n_B = cross[0]
            x = p[0] + cross[1] / n_B, p[1] + cross[2] / n_B, p[2] + cross[3] / n_B
            f *= n_B * (1.0 - n_B / joint[0])
            vv = _plus6(vv, scaled(w, f))
            wv = _plus9(wv, turning(x, w, f))
            ww = _plus6(ww, turned(x, w, f))
    _write(sums[1:], pull, vv, wv, ww)
    if cost.valued:
        for i in range(n):  # on its own: a logarithm would keep the loop above from vector code
            sums[0] += 0.5 * np.log(balls[GAIN, i])


@inlined
def _moments_of(rows: Floats, i: Integer) -> Moments:
    return (
        *(rows[0, i], rows[1, i], rows[2, i], rows[3, i], rows[4, i]),
        *(rows[5, i], rows[6, i], rows[7, i], rows[8, i], rows[9, i]),
    )


@inlined
def pull_of(
    p: Triple, cross: Moments, joint: Moments, w: Symmetric, f: float, more: float
) -> _Six:
    """Return one centre's gradient (omega, v); the sums of a ball are relative to its centre p.

    more: own points count as this much farther from the centre.
    """
    n, sx, sy, sz, xx, xy, xz, yy, yz, zz = cross
    k = joint[0]
    mx = (joint[1] + more * (joint[1] - sx)) / k
    my = (joint[2] + more * (joint[2] - sy)) / k
    mz = (joint[3] + more * (joint[3] - sz)) / k
    # v: W sum(x_l - m)
    bx, by, bz = times(w, sx - n * mx, sy - n * my, sz - n * mz)
    # omega: sum x_l x W (x_l - m) = p x b + sum d x W d - s x W m
    ux, uy, uz = times(w, mx, my, mz)
    _, ay, az = times(w, xx, xy, xz)  # rows of S W
    cx, _, cz = times(w, xy, yy, yz)
    ex, ey, _ = times(w, xz, yz, zz)
    px, py, pz = p
    return (
        f * (py * bz - pz * by + cz - ey - (sy * uz - sz * uy)),
        f * (pz * bx - px * bz + ex - az - (sz * ux - sx * uz)),
        f * (px * by - py * bx + ay - cx - (sx * uy - sy * ux)),
        f * bx,
        f * by,
        f * bz,
    )


@inlined
def turning(p: Triple, w: Symmetric, f: float) -> _Nine:
    """Return f [x]_x W, of f J^T W J with J = [-[x]_x, I] for the motion of the moving mean x."""
    x, y, z = p
    xx, xy, xz, yy, yz, zz = w
    return (
        *(f * (y * xz - z * xy), f * (y * yz - z * yy), f * (y * zz - z * yz)),
        *(f * (z * xx - x * xz), f * (z * xy - x * yz), f * (z * xz - x * zz)),
        *(f * (x * xy - y * xx), f * (x * yy - y * xy), f * (x * yz - y * xz)),
    )


@inlined
def turned(p: Triple, w: Symmetric, f: float) -> _Six:
    """Return the upper half of -f [x]_x W [x]_x."""
    x, y, z = p
    a00, a01, a02, a10, a11, a12, a20, a21, _ = turning(p, w, f)
    return (
        *(a02 * y - a01 * z, a00 * z - a02 * x, a01 * x - a00 * y),
        *(a10 * z - a12 * x, a11 * x - a10 * y, a21 * x - a20 * y),
    )


@inlined
def _plus6(a: _Six, b: _Six) -> _Six:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@inlined
def _plus9(a: _Nine, b: _Nine) -> _Nine:
    return (*_plus6(a[:6], b[:6]), a[6] + b[6], a[7] + b[7], a[8] + b[8])


@inlined
def _write(sums: Floats, pull: _Six, vv: _Six, wv: _Nine, ww: _Six) -> None:
    for c in range(6):
        sums[c] += pull[c]
        sums[6 + c] += vv[c]
        sums[21 + c] += ww[c]
    for c in range(9):
        sums[12 + c] += wv[c]
