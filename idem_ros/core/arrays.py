"""Names of arrays by their shapes, so that signatures tell them; all float64 unless said.

A checker tells the names of one element type from another's, and cannot tell the shapes.
"""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

LARGEST = 1e100  # of any number that is measured: its square is a number, too

Floats: TypeAlias = NDArray[np.float64]  # of a shape that is said where it is used
Mask: TypeAlias = NDArray[np.bool_]  # likewise
Integers: TypeAlias = NDArray[np.int64]  # likewise
Integers32: TypeAlias = NDArray[np.int32]  # likewise
Indices: TypeAlias = NDArray[np.signedinteger[Any]]  # (n,), of any width

Point: TypeAlias = NDArray[np.float64]  # (3,)
Points: TypeAlias = NDArray[np.float64]  # (N, 3)
Matrix3: TypeAlias = NDArray[np.float64]  # (3, 3)
RotationMatrix: TypeAlias = NDArray[np.float64]  # (3, 3), orthonormal
Rotations: TypeAlias = NDArray[np.float64]  # (K, 3, 3)
Transform: TypeAlias = NDArray[np.float64]  # (4, 4), rigid
Transforms: TypeAlias = NDArray[np.float64]  # (K, 4, 4)

Twist: TypeAlias = NDArray[np.float64]  # (6,): (omega, v), [rad] and [length]
Twists: TypeAlias = NDArray[np.float64]  # (6, k): one in each column
Matrix6: TypeAlias = NDArray[np.float64]  # (6, 6), by twists

Weights: TypeAlias = NDArray[np.float64]  # (N, 7), or (1, 7) for all: weight and scatter
MomentRows: TypeAlias = NDArray[np.float64]  # (N, 10): `Moments` in rows

# What kernels hold in registers.
Integer: TypeAlias = int | np.integer[Any]
Triple: TypeAlias = tuple[float, float, float]  # (x, y, z)
Symmetric: TypeAlias = tuple[float, float, float, float, float, float]  # (xx, xy, xz, yy, yz, zz)
# (k, s, S) of a ball: k, three of s, six of S as in `Symmetric`
Moments: TypeAlias = tuple[float, float, float, float, float, float, float, float, float, float]
Cell: TypeAlias = tuple[Integer, Integer, Integer]  # of a grid, along x, y, z

# What `Balls.sides` returns, for the target's points as centres, and for the source's.
Centres: TypeAlias = tuple[Points, MomentRows]  # and the moments of their balls in their own cloud
Members: TypeAlias = tuple[
    Points, Weights, Integers, Integers32
]  # and `Candidates`: first, member
Side: TypeAlias = tuple[Centres, Members]
Sides: TypeAlias = tuple[Side, Side]
