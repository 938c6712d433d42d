"""How a ball pulls: along which axes of its covariance, and how much it counts."""

from idem_ros.core.jit import kernel

BALANCED = 0.35  # of the radius, between the means of a ball's two clouds
MOST_BEND = 2.0


@kernel
def inverse(s, det):
    """Return the inverse of a symmetric matrix (xx, xy, xz, yy, yz, zz), given its determinant."""
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


@kernel
def along_thinnest(w):
    """Return W^3 / tr(W)^2: each axis of S by the square of its share of the pull.

    Along the surface the two clouds' means differ by where either happens to end or to be sampled,
    not by a misalignment: rings of a LiDAR would draw each other together.
    """
    square = _product(w, w)
    trace = w[0] + w[3] + w[5]
    xx, xy, xz, yy, yz, zz = _product(square, w)
    f = 1.0 / (trace * trace)
    return xx * f, xy * f, xz * f, yy * f, yz * f, zz * f


@kernel
def balance(joint, cross, r2):
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


@kernel
def bend(joint, cross):
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


@kernel
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
