"""Sums over blocks of balls, around both clouds, as one gradient and one Gauss-Newton matrix."""

import numpy as np

from idem_ros.core.arrays import Floats, Integers, Matrix6, Transforms, Twist
from idem_ros.core.geometry.se3 import adjoint_of, inverse_of
from idem_ros.core.jit import inlined, kernel

# One block's sums: the value, the gradient (omega, v), then of the matrix vv (6), omega-v (9),
# omega-omega (6).
SUMS, VV = 28, 7  # VV: the matrix's first entry of vv, above 0 wherever there is a ball


def _places() -> Integers:
    """Return where in the sums after the value each entry of the matrix is, (6, 6)."""
    place = np.empty((6, 6), int)
    upper = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
    place[3:, 3:], place[:3, :3] = 6 + upper, 21 + upper
    place[:3, 3:] = np.arange(12, 21).reshape(3, 3)
    place[3:, :3] = place[:3, 3:].T
    return place


_MATRIX = _places()


@kernel
def of_both(here: Floats, there: Floats, transforms: Transforms) -> tuple[Floats, Floats, Floats]:
    """Return values (G,), gradients (G, 6) and Gauss-Newton matrices (G, 6, 6), twist (omega, v).

    Of the sums (blocks, G, 28) around the target's centres, for a twist on the left of
    T_target_source, and around the source's, for one on the left of its inverse: exp(xi) T has
    the inverse exp(-Ad(T)^-1 xi) T^-1.

    transforms: (G, 4, 4) T_target_source of each group, or (1, 4, 4) of all.
    """
    n = transforms.shape[1] + 2  # 6, unknown to the compiler, which would unroll for seconds
    groups, back = here.shape[1], np.empty((6, 6))
    values, pulls, stiffness = np.zeros(groups), np.zeros((groups, 6)), np.zeros((groups, 6, 6))
    pull, matrix, product_ = np.empty(6), np.empty((6, 6)), np.empty((6, 6))
    for g in range(groups):
        if g < len(transforms):
            back = adjoint_of(inverse_of(transforms[g]))
        weight = _summed(here[:, g, VV]) + _summed(there[:, g, VV])
        if weight == 0.0:  # no ball of the group holds points of both clouds
            continue
        values[g] = _summed(here[:, g, 0]) + _summed(there[:, g, 0])
        _unpack(there[:, g, 1:], n, pull, matrix)
        _unpack(here[:, g, 1:], n, pulls[g], stiffness[g])
        for i in range(n):
            for j in range(n):
                pulls[g, i] -= back[j, i] * pull[j]
                product_[i, j] = 0.0
                for k in range(n):
                    product_[i, j] += matrix[i, k] * back[k, j]
        for i in range(n):
            for j in range(n):
                for k in range(n):
                    stiffness[g, i, j] += back[k, i] * product_[k, j]
    return values, pulls, stiffness


@inlined
def _summed(sums: Floats) -> float:
    total = 0.0
    for each in sums:
        total += each
    return total


@inlined
def _unpack(sums: Floats, n: int, pull: Twist, matrix: Matrix6) -> None:
    """Fill gradient (6,) and matrix (6, 6) with the sum of rows (blocks, 27)."""
    for i in range(n):
        pull[i] = 0.0
        for b in range(sums.shape[0]):
            pull[i] += sums[b, i]
        for j in range(n):
            matrix[i, j] = 0.0
            for b in range(sums.shape[0]):
                matrix[i, j] += sums[b, _MATRIX[i, j]]
