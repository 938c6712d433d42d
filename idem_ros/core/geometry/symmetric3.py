"""Symmetric 3x3 matrices in kernels, as the six numbers (xx, xy, xz, yy, yz, zz)."""

from idem_ros.core.arrays import RotationMatrix, Symmetric, Triple
from idem_ros.core.jit import inlined


@inlined
def determinant(s: Symmetric) -> float:
    """Return det S."""
    xx, xy, xz, yy, yz, zz = s
    return xx * (yy * zz - yz * yz) - xy * (xy * zz - xz * yz) + xz * (xy * yz - xz * yy)


@inlined
def adjugate(s: Symmetric) -> Symmetric:
    """Return det S times the inverse of S; its trace is the sum of the principal minors."""
    xx, xy, xz, yy, yz, zz = s
    return (
        yy * zz - yz * yz,
        xz * yz - xy * zz,
        xy * yz - xz * yy,
        xx * zz - xz * xz,
        xy * xz - xx * yz,
        xx * yy - xy * xy,
    )


@inlined
def scaled(s: Symmetric, f: float) -> Symmetric:
    """Return f S."""
    return s[0] * f, s[1] * f, s[2] * f, s[3] * f, s[4] * f, s[5] * f


@inlined
def inverse(s: Symmetric, det: float) -> Symmetric:
    """Return the inverse of S, given its determinant."""
    return scaled(adjugate(s), 1.0 / det)


@inlined
def trace(s: Symmetric) -> float:
    """Return tr S."""
    return s[0] + s[3] + s[5]


@inlined
def product(a: Symmetric, b: Symmetric) -> Symmetric:
    """Return A B of two matrices of the same axes, which is symmetric, too."""
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


@inlined
def times(s: Symmetric, x: float, y: float, z: float) -> Triple:
    """Return S (x, y, z)."""
    xx, xy, xz, yy, yz, zz = s
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


@inlined
def rotated(R: RotationMatrix, s: Symmetric) -> Symmetric:
    """Return R S R^T for a rotation R (3, 3)."""
    ax, ay, az = times(s, R[0, 0], R[0, 1], R[0, 2])
    bx, by, bz = times(s, R[1, 0], R[1, 1], R[1, 2])
    cx, cy, cz = times(s, R[2, 0], R[2, 1], R[2, 2])
    return (
        ax * R[0, 0] + ay * R[0, 1] + az * R[0, 2],
        ax * R[1, 0] + ay * R[1, 1] + az * R[1, 2],
        ax * R[2, 0] + ay * R[2, 1] + az * R[2, 2],
        bx * R[1, 0] + by * R[1, 1] + bz * R[1, 2],
        bx * R[2, 0] + by * R[2, 1] + bz * R[2, 2],
        cx * R[2, 0] + cy * R[2, 1] + cz * R[2, 2],
    )


@inlined
def thinnest_axis(s: Symmetric) -> Triple:
    """Return the unit axis of the least eigenvalue, where it is much the least.

    The adjugate's widest axis is that one; squaring it leaves little of the others.
    """
    n = adjugate(s)
    for _ in range(4):  # (1/4)^16 is what these leave of the second axis
        n = product(n, n)
        n = scaled(n, 1.0 / trace(n))
    xx, xy, xz, yy, yz, zz = n
    if xx >= yy and xx >= zz:
        x, y, z = xx, xy, xz
    elif yy >= zz:
        x, y, z = xy, yy, yz
    else:
        x, y, z = xz, yz, zz
    f = (x * x + y * y + z * z) ** -0.5
    return x * f, y * f, z * f
