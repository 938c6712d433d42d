"""Factors L D L^T of a sparse symmetric matrix of 6x6 blocks, and the blocks of its inverse.

The inverse itself is dense; of it only the blocks where L has one are needed for those of its
diagonal (Takahashi's equations): from the last column to the first, in the memory of the factors.
"""

# SciPy has no types.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from idem_ros.core.arrays import Floats, Indices, Integers, Integers32
from idem_ros.core.jit import kernel


class Pattern(NamedTuple):
    """Where L has blocks, in an order that keeps them few."""

    place: Integers  # (F,): of each pose in that order
    first: Integers32  # (F + 1,): where each column begins; its diagonal block is left out
    row: Integers32  # (B,): rising in each column


class BlockFactors(NamedTuple):
    """L D L^T of a matrix that is positive definite."""

    pattern: Pattern
    below: Floats  # (B, 6, 6) blocks of L
    diagonal: Floats  # (F, 6, 6) inverses of the blocks of D

    def solved(self, right: Floats) -> Floats:
        """Return the solution (F, 6) for a right-hand side (F, 6)."""
        place, first, row = self.pattern
        x = np.empty_like(right)
        x[place] = right
        _solve(first, row, self.below, self.diagonal, x)
        return x[place]

    def inverse_diagonal(self) -> Floats:
        """Return the (F, 6, 6) blocks on the diagonal of the inverse."""
        place, first, row = self.pattern
        found = self.diagonal.copy()
        _invert(first, row, self.below, np.empty_like(self.below), found)
        return found[place]


def pattern_of(pairs: Indices, count: int) -> Pattern:
    """Return the `Pattern` of a matrix of `count` poses with blocks at pairs (E, 2)."""
    ones = np.ones(2 * len(pairs))
    both = np.concatenate([pairs, pairs[:, ::-1]])
    links = sparse.csc_matrix((ones, tuple(both.T)), (count, count))
    degree = np.asarray(links.sum(axis=1)).ravel()
    # Of a matrix like this one no entry of L cancels: its pattern is that of any numbers.
    dominant = (sparse.diags(degree + 1.0) - links).tocsc()
    options = {'SymmetricMode': True}
    order = 'MMD_AT_PLUS_A'
    factors = splu(dominant, permc_spec=order, diag_pivot_thresh=0.0, options=options)
    lower = sparse.tril(factors.L, -1).tocsc()
    lower.sort_indices()
    return Pattern(
        factors.perm_c.astype(np.int64),
        lower.indptr.astype(np.int32),
        lower.indices.astype(np.int32),
    )


def factored(pattern: Pattern, pairs: Indices, between: Floats, own: Floats) -> BlockFactors:
    """Return the `BlockFactors` of a matrix.

    Args:
        pattern: of these pairs.
        pairs: (E, 2), each two poses; the same two may come again: their blocks add up.
        between: (E, 6, 6) at row pairs[:, 0] and column pairs[:, 1], and transposed across.
        own: (F, 6, 6) on the diagonal.
    """
    place, first, row = pattern
    a, b = place[pairs[:, 0]], place[pairs[:, 1]]
    blocks = np.where((a > b)[:, None, None], between, between.swapaxes(1, 2))
    low, high = np.minimum(a, b), np.maximum(a, b)
    # Rows rise within a column: one number for both finds a block.
    column = np.repeat(np.arange(len(place)), np.diff(first))
    known = column * len(place) + row
    below = np.zeros((len(row), 6, 6))
    np.add.at(below, np.searchsorted(known, low * len(place) + high), blocks)
    diagonal = np.empty_like(own)
    diagonal[place] = own
    _factor(first, row, below, diagonal, np.empty(len(place), np.int32))
    return BlockFactors(pattern, below, diagonal)


@kernel
def _factor(
    first: Integers32, row: Integers32, below: Floats, diagonal: Floats, at: Integers32
) -> None:
    """Turn the matrix into L, and into the inverses of D; column after column to the right."""
    for j in range(len(first) - 1):
        begin, end = first[j], first[j + 1]
        diagonal[j] = np.linalg.inv(diagonal[j])
        for m in range(begin, end):
            c = row[m]
            scaled = below[m] @ diagonal[j]
            diagonal[c] -= scaled @ below[m].T
            for k in range(first[c], first[c + 1]):
                at[row[k]] = k
            for k in range(m + 1, end):
                below[at[row[k]]] -= below[k] @ scaled.T
        for m in range(begin, end):
            below[m] = below[m] @ diagonal[j]


@kernel
def _solve(first: Integers32, row: Integers32, below: Floats, diagonal: Floats, x: Floats) -> None:
    """Turn a right-hand side (F, 6) into the solution."""
    n = len(first) - 1
    for j in range(n):
        for k in range(first[j], first[j + 1]):
            x[row[k]] -= below[k] @ x[j]
    for j in range(n - 1, -1, -1):
        x[j] = diagonal[j] @ x[j]
        for k in range(first[j], first[j + 1]):
            x[j] -= below[k].T @ x[row[k]]


@kernel
def _invert(
    first: Integers32, row: Integers32, below: Floats, z: Floats, diagonal: Floats
) -> None:
    """Fill z (B, 6, 6) and the diagonal with the inverse, where L has blocks."""
    at = np.empty(len(first) - 1, np.int32)
    for j in range(len(first) - 2, -1, -1):
        begin, end = first[j], first[j + 1]
        z[begin:end] = 0.0
        for m in range(begin, end):
            c = row[m]
            z[m] -= diagonal[c] @ below[m]
            for k in range(first[c], first[c + 1]):
                at[row[k]] = k
            for k in range(m + 1, end):
                z_kc = z[at[row[k]]]
                z[k] -= z_kc @ below[m]
                z[m] -= z_kc.T @ below[k]
        for m in range(begin, end):
            diagonal[j] -= z[m].T @ below[m]
