import numpy as np
import pytest

from idem_ros.core.several.block_factors import factored, pattern_of


def graph(rng, count, extra):
    """A positive definite matrix of blocks on a chain and some pairs, and the same dense."""
    pairs = np.array(
        [(k, k + 1) for k in range(count - 1)]
        + [(k + 1, k) for k in range(0, count - 1, 3)]  # the same two again, the other way round
        + [tuple(rng.choice(count, 2, replace=False)) for _ in range(extra)]
    )
    J, K = rng.normal(size=(2, len(pairs), 6, 6))
    own = np.tile(0.1 * np.eye(6), (count, 1, 1))
    np.add.at(own, pairs[:, 0], J.swapaxes(1, 2) @ J)
    np.add.at(own, pairs[:, 1], K.swapaxes(1, 2) @ K)
    between = J.swapaxes(1, 2) @ K
    dense = np.zeros((count, 6, count, 6))
    for k, block in enumerate(own):
        dense[k, :, k] += block
    for (i, j), block in zip(pairs, between, strict=True):
        dense[i, :, j] += block
        dense[j, :, i] += block.T
    return pairs, between, own, dense.reshape(6 * count, 6 * count)


@pytest.mark.parametrize(('count', 'extra'), [(2, 0), (5, 0), (12, 5), (40, 60)])
def test_the_solution_and_the_inverse_are_those_of_the_dense_matrix(rng, count, extra):
    pairs, between, own, dense = graph(rng, count, extra)
    factors = factored(pattern_of(pairs, count), pairs, between, own)
    right = rng.normal(size=(count, 6))
    solution = np.linalg.solve(dense, right.ravel()).reshape(count, 6)
    np.testing.assert_allclose(factors.solved(right), solution, rtol=1e-9, atol=1e-12)
    inverse = np.linalg.inv(dense).reshape(count, 6, count, 6)
    blocks = [inverse[k, :, k] for k in range(count)]
    np.testing.assert_allclose(factors.inverse_diagonal(), blocks, rtol=1e-9, atol=1e-12)


def test_one_pose_alone_is_its_own_block(rng):
    own = np.diag(np.arange(1.0, 7.0))[None]
    none = np.empty((0, 2), int)
    factors = factored(pattern_of(none, 1), none, np.empty((0, 6, 6)), own)
    np.testing.assert_allclose(factors.solved(np.ones((1, 6)))[0], 1 / np.arange(1.0, 7.0))
    np.testing.assert_allclose(factors.inverse_diagonal()[0], np.diag(1 / np.arange(1.0, 7.0)))


def test_a_chain_fills_nothing_in():
    chain = np.array([(k, k + 1) for k in range(99)])
    assert len(pattern_of(chain, 100).row) == 99
