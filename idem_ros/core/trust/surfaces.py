"""The surfaces in balls, as either cloud has them: what lies in a plane, and is no line."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Indices,
    Integers,
    MomentRows,
    Point,
    Points,
    RotationMatrix,
    Side,
    Symmetric,
    Transform,
    Triple,
)
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.symmetric3 import adjugate, determinant, thinnest_axis, trace
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.cloud import Neighbourhoods
from idem_ros.core.metric.moments import (
    ball_moments,
    covariance,
    into_frame,
    point_of,
    rotated,
    row_of,
)
from idem_ros.core.metric.noise import LEAST_MEMBERS, LEAST_SPREAD
from idem_ros.core.workers import in_blocks

# Of a surface: least second variance over the first, and of the two greater ones' product over the
# squared trace, where less is a line: 0.08 where the second is a tenth of the third.
SURFACE, PLAIN = (4.0, LEAST_SPREAD), (16.0, 0.14)
ACROSS = 0.3  # least cosine of its normal to a way that it lies across


class Surfaces(NamedTuple):
    """The surfaces in the balls around both clouds' centres, in the frame of the target."""

    own: Floats  # (n, 6): j = (x times n, n) of the centre's cloud's
    other: Floats  # (n, 6): of the other cloud's, the normals' signs alike
    mean: Points  # (n, 3): of the own points
    variance: Floats  # (n,): of a normal
    centres: tuple[Indices, Indices]  # of the target, then of the source
    T_target_source: Transform


def surfaces(
    balls: Balls, T: Transform, shape: tuple[float, float], sample: float = np.inf
) -> Surfaces:
    """Return the `Surfaces` where both clouds have one.

    Args:
        balls: `Balls` of the clouds.
        T: (4, 4) T_target_source, between the clouds' origins.
        shape: `SURFACE` or `PLAIN`: what is one.
        sample: of about so many centres of each cloud.

    Raises:
        OutOfTime: the workers of the balls are late.
    """
    motions = zip(*se3.both_ways(T), strict=True)
    here, there = (
        _planes(side, motion, balls, shape, sample)
        for side, motion in zip(balls.sides(T), motions, strict=True)
    )
    to_source = se3.adjoint(se3.inverse(T))
    return Surfaces(
        np.concatenate([here.own, there.own @ to_source]),
        np.concatenate([here.other, there.other @ to_source]),
        np.concatenate([here.mean, se3.transform_points(T, there.mean)]),
        np.concatenate([here.variance, there.variance]),
        (here.centre, there.centre),
        T,
    )


def own_surfaces(
    cloud: Neighbourhoods, shape: tuple[float, float], among: Indices | None = None
) -> tuple[Points, Points, Indices]:
    """Return those balls of a cloud that hold a surface of its own: mean, normal (n, 3), which.

    Normals point away from the cloud's middle: a wall is seen from one side.

    among: (m,) the balls that are asked; None: all.
    """
    centres, own = cloud.grid.points, cloud.own
    if among is None:
        found, which = _own_surfaces(centres, own, shape)
    else:
        found, which = _own_surfaces(centres.take(among, axis=0), own.take(among, axis=0), shape)
        which = among[which]
    return found[:, :3], found[:, 3:], which


@kernel
def _own_surfaces(
    centres: Points, own: MomentRows, shape: tuple[float, float]
) -> tuple[Floats, Integers]:
    rows, which, n = np.empty((len(own), 6)), np.empty(len(own), np.int64), 0
    for i in range(len(own)):
        if own[i, 0] < LEAST_MEMBERS:
            continue
        m = row_of(own, i)
        flatness, normal = _flatness_and_normal(covariance(m), shape)
        if flatness < 0.0:
            continue
        outwards = 0.0
        for k in range(3):
            rows[n, k] = centres[i, k] + m[1 + k] / m[0]
            outwards += rows[n, k] * normal[k]
        for k in range(3):
            rows[n, 3 + k] = normal[k] if outwards >= 0.0 else -normal[k]
        which[n] = i
        n += 1
    return rows[:n], which[:n]


class _Planes(NamedTuple):
    """Of the surface in each ball, as the centres' cloud has it and as the other has it."""

    own: Floats  # (n, 6): j = (x times n, n), of mean x and normal n of the own points
    other: Floats  # (n, 6): of the other cloud's, the normals' signs alike
    mean: Points  # (n, 3): of the own points
    variance: Floats  # (n,): of a normal, the two clouds' geometric mean
    centre: Integers  # (n,): which one


def _planes(
    side: Side,
    motion: tuple[RotationMatrix, Point],
    balls: Balls,
    shape: tuple[float, float],
    sample: float,
) -> _Planes:
    """Return the `_Planes` of every so-many-th ball, about as many as the sample."""
    n = len(side[0][0])
    stride = int(max(n // sample, 1))

    def of_block(begin: int, end: int) -> _Planes:
        """Return those of a block of the balls that are asked."""
        most = end - begin
        room = _Planes(
            np.empty((most, 6)),
            np.empty((most, 6)),
            np.empty((most, 3)),
            np.empty(most),
            np.empty(most, np.int64),
        )
        asked = begin * stride, min(end * stride, n), stride
        found = _fill_planes(side, motion, balls.r2, shape, asked, room)
        return _Planes(
            room.own[:found],
            room.other[:found],
            room.mean[:found],
            room.variance[:found],
            room.centre[:found],
        )

    blocks = in_blocks(-(-n // stride), balls.workers, of_block)
    return _Planes(
        np.concatenate([each.own for each in blocks]),
        np.concatenate([each.other for each in blocks]),
        np.concatenate([each.mean for each in blocks]),
        np.concatenate([each.variance for each in blocks]),
        np.concatenate([each.centre for each in blocks]),
    )


@kernel
def _fill_planes(
    side: Side,
    motion: tuple[RotationMatrix, Point],
    r2: float,
    shape: tuple[float, float],
    asked: tuple[int, int, int],
    planes: _Planes,
) -> int:
    """Fill the `_Planes` of a range of centres' balls; return how many hold a surface."""
    n = 0
    (centres, own), (points, weights, first, member) = side
    R, t = motion
    for i in range(asked[0], asked[1], asked[2]):
        if own[i, 0] < LEAST_MEMBERS or first[i + 1] == first[i]:
            continue
        p = point_of(centres, i)
        x = into_frame(p, R, t)
        begin, end = np.uint64(first[i]), np.uint64(first[i + 1])
        _, m = ball_moments(x, points, weights, member, begin, end, r2)
        if m[0] < LEAST_MEMBERS:
            continue
        a, b = row_of(own, i), rotated(R, m)
        va, na = _flatness_and_normal(covariance(a), shape)
        vb, nb = _flatness_and_normal(covariance(b), shape)
        if va < 0.0 or vb < 0.0:
            continue
        xa = (p[0] + a[1] / a[0], p[1] + a[2] / a[0], p[2] + a[3] / a[0])
        xb = (p[0] + b[1] / b[0], p[1] + b[2] / b[0], p[2] + b[3] / b[0])
        sign = 1.0 if na[0] * nb[0] + na[1] * nb[1] + na[2] * nb[2] >= 0.0 else -1.0
        _fill_jacobian(planes.own[n], xa, na, 1.0)
        _fill_jacobian(planes.other[n], xb, nb, sign)
        planes.mean[n, 0], planes.mean[n, 1], planes.mean[n, 2] = xa
        planes.variance[n] = np.sqrt(va / a[0] * vb / b[0])
        planes.centre[n] = i
        n += 1
    return n


@inlined
def _flatness_and_normal(s: Symmetric, shape: tuple[float, float]) -> tuple[float, Triple]:
    """Return first variance over second, and the first's axis: the normal of a surface.

    -1 where a covariance is no surface's, see `SURFACE`. The variance of a normal is this over the
    members.
    """
    det, minors, spread = determinant(s), trace(adjugate(s)), trace(s)
    flat, broad = shape
    if not (minors > broad * spread * spread and flat * det * spread < minors * minors):
        return -1.0, (0.0, 0.0, 0.0)
    return max(det, 0.0) * spread / (minors * minors), thinnest_axis(s)


@inlined
def _fill_jacobian(j: Floats, x: Triple, n: Triple, sign: float) -> None:
    j[0] = sign * (x[1] * n[2] - x[2] * n[1])
    j[1] = sign * (x[2] * n[0] - x[0] * n[2])
    j[2] = sign * (x[0] * n[1] - x[1] * n[0])
    j[3], j[4], j[5] = sign * n[0], sign * n[1], sign * n[2]
