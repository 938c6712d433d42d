"""q_tot of several clouds (Eq. 8 over the union of all), linearised in a small motion of each.

A ball holds n_b members of cloud b, N in all, with the mean m; W = Sigma^-1 and
rho = c det Sigma / (1 + c det Sigma), as of two clouds. With the members held,

    dq / d(omega_b, v_b) = (rho / N) sum_{l in b} (x_l - m)^T W [-[x_l]x, I]

The sum of these over all clouds of a ball vanishes: a common motion changes nothing. The matrix
is (rho / N) (delta_bb' n_b - n_b n_b' / N) J^T W J, with J = [-[p]x, I] at the ball's centre p for
all of its clouds: so that it, too, vanishes for a common motion. Its diagonal is then the sum of
what is off it, which alone is added up.
"""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Integer,
    Integers,
    Integers32,
    Moments,
    Symmetric,
    Transforms,
    Triple,
)
from idem_ros.core.geometry.symmetric3 import determinant, inverse
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.metric.candidates import Candidates
from idem_ros.core.metric.entropy import MOST_WITHOUT_ENTROPY
from idem_ros.core.metric.moments import ball_moments, covariance, plus, point_of, row_of
from idem_ros.core.several.joint_balls import SHARES, JointBalls, Placed
from idem_ros.core.several.joint_candidates import Centres
from idem_ros.core.solve.ball_cost import BallCost, balance, with_noise, without_tangential
from idem_ros.core.solve.linearization import pull_of, turned, turning
from idem_ros.core.workers import in_threads

SAMPLE = 16_384  # centres, about, that the matrix is taken from: it only steers
BLOCK_SUMS = 21  # of J^T W J: vv (6), omega-v (9), omega-omega (6)


class JointLinearization(NamedTuple):
    """q_tot near poses, in a twist (omega, v) of each cloud about the common frame's origin."""

    pulls: Floats  # (K, 6): gradient; or (G, K, 6), of groups of centres
    pairs: Integers  # (E, 2): clouds that share a ball, the lesser number first
    blocks: Floats  # (E, 21): minus the matrix's block of each pair


def linearized(
    balls: JointBalls, cost: BallCost, poses: Transforms, sample: float = SAMPLE
) -> JointLinearization:
    """Return the `JointLinearization` at poses (K, 4, 4).

    sample: how many centres the matrix is taken from, about.
    """
    lists, placed = balls.placed(poses)
    stride = max(int(len(lists.centres.place) / sample), 1)
    pulls = np.zeros((SHARES, balls.count, 6))
    blocks = np.zeros((SHARES, len(lists.pairs), BLOCK_SUMS))
    groups = np.zeros(len(lists.order), np.int64)

    def add(share: int) -> None:
        """Add the centres of a share to its sums."""
        sums = pulls[share][None], blocks[share]
        for some, candidates in balls.blocks(lists, share):
            accumulate(placed, candidates, some, groups, cost, (lists.pair_of, stride), sums)

    in_threads(balls.workers, add, range(SHARES))
    return JointLinearization(pulls.sum(axis=0), lists.pairs, blocks.sum(axis=0))


@kernel
def accumulate(
    placed: Placed,
    candidates: Candidates,
    centres: Centres,
    group: Integers,
    cost: BallCost,
    matrix: tuple[Integers32, int],
    sums: tuple[Floats, Floats],
) -> None:
    """Add gradient and matrix of a block of balls to sums.

    Args:
        placed: all points.
        candidates: of the block's centres.
        centres: these.
        group: (N,) which group each point is in, as a centre.
        cost: `BallCost`; neither valued nor corrected for curvature.
        matrix: which pair two clouds are, (K, K), and each which centre it is taken from.
        sums: (G, K, 6) and (E, 21).
    """
    (pair_of, stride), (pulls, blocks) = matrix, sums
    first, member = candidates
    moments = np.empty((pulls.shape[1], 10))
    seen = np.empty(pulls.shape[1], np.int32)
    i: int
    for k, i in enumerate(centres.place):
        n = members_by_cloud(placed, i, (first[k], first[k + 1]), member, cost.r2, moments, seen)
        if n == 0:
            continue
        (f, w), joint = ball_of(placed, i, cost, seen[:n], moments)
        f *= centres.weight[k]
        if f > 0.0:
            p = point_of(placed.points, i)
            _add_pulls(p, joint, (f, w), placed.cloud[i], seen[:n], moments, pulls[group[i]])
            if k % stride == 0:
                of_centre = placed.cloud[i], placed.own[i, 0]
                f *= stride / joint[0]
                _add_blocks(p, (f, w), of_centre, seen[:n], moments, pair_of, blocks)


@inlined
def members_by_cloud(
    placed: Placed,
    i: Integer,
    span: tuple[Integer, Integer],
    member: Integers32,
    r2: float,
    moments: Floats,
    seen: Integers32,
) -> int:
    """Fill moments (K, 10) of a ball's members by their clouds; return of how many there are.

    seen: filled with these clouds.
    """
    p = point_of(placed.points, i)
    n, c, end = 0, np.uint64(span[0]), np.uint64(span[1])
    while c < end:  # the members stand cloud by cloud
        b, last = placed.cloud[np.uint64(member[c])], c + np.uint64(1)
        while last < end and placed.cloud[np.uint64(member[last])] == b:
            last += np.uint64(1)
        _, m = ball_moments(p, placed.points, placed.weights, member, c, last, r2)
        c = last
        if m[0] > 0.0:
            seen[n] = b
            n += 1
            row = moments[b]
            row[0], row[1], row[2], row[3], row[4] = m[0], m[1], m[2], m[3], m[4]
            row[5], row[6], row[7], row[8], row[9] = m[5], m[6], m[7], m[8], m[9]
    return n


@inlined
def ball_of(
    placed: Placed, i: Integer, cost: BallCost, seen: Integers32, moments: Floats
) -> tuple[tuple[float, Symmetric], Moments]:
    """Return rho / N and W of a ball, 0.0 where it has no entropy, and its joint moments."""
    joint = own = row_of(placed.own, i)
    for b in seen:
        joint = plus(joint, row_of(moments, b))
    return _weighed(joint, own, cost), joint


@inlined
def _weighed(joint: Moments, own: Moments, cost: BallCost) -> tuple[float, Symmetric]:
    """Return rho / N and W of a ball; 0.0 where it has no entropy."""
    if joint[0] <= MOST_WITHOUT_ENTROPY:
        return 0.0, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    sigma = with_noise(covariance(joint), cost.noise)
    det = determinant(sigma)
    if det <= 0.0:
        return 0.0, sigma
    w = inverse(sigma, det)
    f = cost.c * det / (1.0 + cost.c * det) / joint[0]
    if cost.tangential:
        w = without_tangential(w)
        others = (
            *(joint[0] - own[0], joint[1] - own[1], joint[2] - own[2], joint[3] - own[3]),
            *(joint[4] - own[4], joint[5] - own[5], joint[6] - own[6]),
            *(joint[7] - own[7], joint[8] - own[8], joint[9] - own[9]),
        )
        f *= balance(joint, others, cost.apart2)
    return f, w


@inlined
def _add_pulls(
    p: Triple,
    joint: Moments,
    weight: tuple[float, Symmetric],
    a: Integer,
    seen: Integers32,
    moments: Floats,
    pulls: Floats,
) -> None:
    """Add the gradient (K, 6) of a ball around a point of cloud a, whose own is minus the rest."""
    f, w = weight
    x = y = z = vx = vy = vz = 0.0
    for b in seen:
        pull = pull_of(p, row_of(moments, b), joint, w, f, 0.0)
        row = pulls[b]
        row[0] += pull[0]
        row[1] += pull[1]
        row[2] += pull[2]
        row[3] += pull[3]
        row[4] += pull[4]
        row[5] += pull[5]
        x, y, z = x + pull[0], y + pull[1], z + pull[2]
        vx, vy, vz = vx + pull[3], vy + pull[4], vz + pull[5]
    own = pulls[a]
    own[0] -= x
    own[1] -= y
    own[2] -= z
    own[3] -= vx
    own[4] -= vy
    own[5] -= vz


@inlined
def _add_blocks(
    p: Triple,
    weight: tuple[float, Symmetric],
    of_centre: tuple[Integer, float],
    seen: Integers32,
    moments: Floats,
    pair_of: Integers32,
    blocks: Floats,
) -> None:
    """Add n_b n_b' J^T W J of a ball to the blocks (E, 21) of its pairs of clouds."""
    (f, w), (a, n_own) = weight, of_centre
    wv, ww = turning(p, w, f), turned(p, w, f)
    vv = (f * w[0], f * w[1], f * w[2], f * w[3], f * w[4], f * w[5])
    for q in range(len(seen)):
        b = seen[q]
        n_b = moments[b, 0]
        _add_block(blocks[pair_of[a, b]], n_own * n_b, vv, wv, ww)
        for o in range(q):
            other = seen[o]
            _add_block(blocks[pair_of[b, other]], n_b * moments[other, 0], vv, wv, ww)


@inlined
def _add_block(
    block: Floats,
    f: float,
    vv: Symmetric,
    wv: tuple[float, float, float, float, float, float, float, float, float],
    ww: Symmetric,
) -> None:
    for c in range(6):
        block[c] += f * vv[c]
        block[15 + c] += f * ww[c]
    for c in range(9):
        block[6 + c] += f * wv[c]
