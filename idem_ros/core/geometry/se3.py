"""Rigid motions as 4x4 matrices: checked, inverted, and the exponential of a twist."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from idem_ros.core.arrays import (
    LARGEST,
    Floats,
    Matrix3,
    Matrix6,
    Point,
    Points,
    RotationMatrix,
    Rotations,
    Transform,
    Transforms,
    Triple,
    Twist,
)
from idem_ros.core.exceptions import InvalidTransform
from idem_ros.core.jit import inlined, kernel

ORTHONORMALITY_TOLERANCE = 1e-3
LAST_ROW_TOLERANCE = 1e-6  # a small translation there is a transposed matrix
ROS_ORDER = [3, 4, 5, 0, 1, 2]  # x y z rx ry rz of a twist (omega, v), and back


def checked_transform(transform: ArrayLike, name: str = 'T_target_source') -> Transform:
    """Return a rigid transform as (4, 4) float64, its rotation made exactly orthonormal.

    Args:
        transform: (4, 4) homogeneous matrix; its rotation may be off by 1e-3 (rounded digits).
        name: what the message calls it.

    Raises:
        InvalidTransform: wrong shape, not finite, a last row other than 0 0 0 1, or no rotation.
    """
    try:
        if np.iscomplexobj(transform):
            raise TypeError('complex')
        matrix = np.array(transform, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidTransform(f'{name} is not a matrix of numbers: {error}') from error
    if matrix.shape != (4, 4):
        raise InvalidTransform(f'{name} has shape {matrix.shape}; it must be (4, 4)')
    if not np.isfinite(matrix).all():
        raise InvalidTransform(f'{name} holds values that are not finite')
    if np.abs(matrix).max() > LARGEST:
        raise InvalidTransform(f'{name} holds {np.abs(matrix).max():.3g}, which nothing measures')
    if np.abs(matrix[3] - (0, 0, 0, 1)).max() > LAST_ROW_TOLERANCE:
        raise InvalidTransform(f'{name} has the last row {matrix[3]}; it must be 0 0 0 1')
    rotation = matrix[:3, :3]
    with np.errstate(over='ignore', invalid='ignore'):
        error = np.abs(rotation @ rotation.T - np.eye(3)).max()
        determinant = np.linalg.det(rotation)
    if not error <= ORTHONORMALITY_TOLERANCE or determinant < 0:  # of 1e300 it is not a number
        raise InvalidTransform(
            f'{name} is not rigid: R Rt is off the identity by {error:.2g}, '
            f'det R = {determinant:.3g}; it must be a rotation'
        )
    if error > 1e-12:
        u, _, vt = np.linalg.svd(rotation)
        matrix[:3, :3] = u @ vt
    matrix[3] = (0, 0, 0, 1)
    return matrix


def inverse(transform: Transform) -> Transform:
    """Return the inverse of a (4, 4) rigid transform."""
    return inverse_of(np.ascontiguousarray(transform, dtype=np.float64))


@kernel
def inverse_of(T: Transform) -> Transform:
    """Return what `inverse` does, in a kernel."""
    result = np.eye(4)
    for i in range(3):
        for k in range(3):
            result[i, k] = T[k, i]
            result[i, 3] -= T[k, i] * T[k, 3]
    return result


@kernel
def inverses(transforms: Transforms) -> Transforms:
    """Return the inverses of (K, 4, 4) rigid transforms."""
    result = np.empty(transforms.shape)
    for n in range(transforms.shape[0]):
        T = inverse_of(transforms[n])
        for i in range(4):  # an assignment of the whole costs seconds of compiling
            for k in range(4):
                result[n, i, k] = T[i, k]
    return result


def transform_points(transform: Transform, points: Points) -> Points:
    """Return R p + t for each row p of (..., 3) points, the same bits on every processor."""
    return rotate(transform[:3, :3], points) + transform[:3, 3]


def rotate(rotation: RotationMatrix, vectors: Points) -> Points:
    """Return R v for each row v of (..., 3) vectors, the same bits on every processor.

    Written out: the product through BLAS has others, by the kernel it chooses.
    """
    v = np.asarray(vectors)[..., None]
    return (
        v[..., 0, :] * rotation[:, 0]
        + v[..., 1, :] * rotation[:, 1]
        + v[..., 2, :] * rotation[:, 2]
    )


@kernel
def both_ways(T: Transform) -> tuple[Rotations, Points]:
    """Return R (2, 3, 3) and t (2, 3) of a (4, 4) rigid transform and of its inverse."""
    R, t = np.empty((2, 3, 3)), np.zeros((2, 3))
    for i in range(3):
        t[0, i] = T[i, 3]
        for k in range(3):
            R[0, i, k], R[1, i, k] = T[i, k], T[k, i]
            t[1, i] -= T[k, i] * T[k, 3]
    return R, t


def rotation_and_translation(transform: Transform) -> tuple[RotationMatrix, Point]:
    """Return R (3, 3) and t (3,) of a (4, 4) transform as kernels take them: contiguous."""
    return np.ascontiguousarray(transform[:3, :3]), transform[:3, 3].copy()


def translation(t: Point) -> Transform:
    """Return the (4, 4) motion by t, (3,)."""
    result = np.eye(4)
    result[:3, 3] = t
    return result


def exp(twist: Twist) -> Transform:
    """Return the (4, 4) motion of the twist (omega, v), (6,), in [rad] and [length]."""
    return exps(np.asarray(twist)[None])[0]


def exps(twists: Floats) -> Transforms:
    """Return the motions (K, 4, 4) of twists (K, 6), as `exp` does."""
    return _exps(np.ascontiguousarray(twists, dtype=np.float64))


@kernel
def _exps(twists: Floats) -> Transforms:
    result = np.zeros((len(twists), 4, 4))
    for n in range(len(twists)):
        x, y, z = w = twists[n, 0], twists[n, 1], twists[n, 2]
        a, b, c = _series(x * x + y * y + z * z)
        hat = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
        result[n, 3, 3] = 1.0
        for i in range(3):
            result[n, i, 3] = twists[n, 3 + i]
            for k in range(3):
                square = w[i] * w[k] - (x * x + y * y + z * z) * (i == k)  # hat @ hat
                result[n, i, k] = (i == k) + a * hat[i][k] + b * square
                result[n, i, 3] += (b * hat[i][k] + c * square) * twists[n, 3 + k]
    return result


@inlined
def _series(square: float) -> Triple:
    """Return sin a / a, (1 - cos a) / a^2 and (a - sin a) / a^3 of an angle's square."""
    if square < 1e-8:  # Taylor: the last two lose their digits
        return 1 - square / 6, 0.5 - square / 24, 1 / 6 - square / 120
    angle = np.sqrt(square)
    sine = np.sin(angle)
    return sine / angle, (1 - np.cos(angle)) / square, (angle - sine) / (square * angle)


def log(transform: Transform) -> Twist:
    """Return the twist (omega, v), (6,), whose `exp` is a (4, 4) rigid transform."""
    return _log(np.ascontiguousarray(transform, dtype=np.float64))


@kernel
def _log(T: Transform) -> Twist:
    w, x, y, z = _quaternion(T)
    sine = np.sqrt(x * x + y * y + z * z)  # of half the angle
    half = np.arctan2(sine, w)
    f = 2.0 * half / sine if sine > 1e-8 else 2.0
    result = np.empty(6)
    result[0], result[1], result[2] = f * x, f * y, f * z
    # The inverse of exp's left Jacobian: I - hat / 2 + c hat^2, c = (1 - a/2 cot a/2) / a^2.
    c = (1.0 - half * w / sine) / (4.0 * half * half) if half > 1e-4 else 1.0 / 12.0
    t = (T[0, 3], T[1, 3], T[2, 3])
    rotation = (result[0], result[1], result[2])
    once = _cross(rotation, t)
    twice = _cross(rotation, once)
    for i in range(3):
        result[3 + i] = t[i] - 0.5 * once[i] + c * twice[i]
    return result


@inlined
def _quaternion(T: Transform) -> tuple[float, float, float, float]:
    """Return (w, x, y, z), w >= 0, of a rotation, from the entry that has the most digits."""
    a, b, c = T[0, 0], T[1, 1], T[2, 2]
    x, y, z = T[2, 1] - T[1, 2], T[0, 2] - T[2, 0], T[1, 0] - T[0, 1]
    xy, xz, yz = T[0, 1] + T[1, 0], T[0, 2] + T[2, 0], T[1, 2] + T[2, 1]
    if a + b + c >= max(a, b, c):
        q = (1.0 + a + b + c, x, y, z)
    elif a >= b and a >= c:
        q = (x, 1.0 + a - b - c, xy, xz)
    elif b >= c:
        q = (y, xy, 1.0 - a + b - c, yz)
    else:
        q = (z, xz, yz, 1.0 - a - b + c)
    f = 1.0 / np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    f = -f if q[0] < 0.0 else f
    return q[0] * f, q[1] * f, q[2] * f, q[3] * f


@inlined
def _cross(a: Triple, b: Triple) -> Triple:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def adjoint(transform: Transform) -> Matrix6:
    """Return the (6, 6) matrix that takes a twist (omega, v) through a rigid transform."""
    return adjoint_of(np.ascontiguousarray(transform, dtype=np.float64))


@kernel
def adjoint_of(T: Transform) -> Matrix6:
    """Return what `adjoint` does, in a kernel."""
    result = np.zeros((6, 6))
    for k in range(3):
        moved = _cross((T[0, 3], T[1, 3], T[2, 3]), (T[0, k], T[1, k], T[2, k]))
        for i in range(3):
            result[i, k] = result[3 + i, 3 + k] = T[i, k]
            result[3 + i, k] = moved[i]
    return result


def skew(v: Point) -> Matrix3:
    """Return the (3, 3) matrix of the cross product with v, (3,)."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]], dtype=np.float64)


def rotation_angle(transform: Transform) -> float:
    """Return the angle [rad] of a transform's rotation."""
    return float(Rotation.from_matrix(transform[:3, :3]).magnitude())
