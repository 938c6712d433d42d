"""Gradient and sparse matrix of all poses at once, and Newton's step with some of them held.

A pose moves by a twist (omega, v) about its cloud's own middle, along the common frame's axes: so
clouds far from one another stay well conditioned.
"""

# SciPy has no types.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from idem_ros.core.arrays import Floats, Integers, Mask, Points, Transforms
from idem_ros.core.geometry import se3
from idem_ros.core.several.joint_linearization import BLOCK_SUMS, JointLinearization
from idem_ros.core.several.problem import PosePrior
from idem_ros.core.solve.newton import LEAST_STIFFNESS


class JointSystem(NamedTuple):
    """Newton's equations of the poses that are not held."""

    gradient: Floats  # (6 F,)
    matrix: Any  # (6 F, 6 F), sparse
    free: Integers  # (F,): which clouds

    def step(self) -> Floats:
        """Return Newton's step (F, 6); motions without stiffness have none."""
        return self.solved(-self.gradient).reshape(-1, 6)

    def solved(self, right: Floats) -> Floats:
        """Return the solution (6 F,) or (6 F, n) of the equations with another right-hand side."""
        if len(self.free) == 0:
            return np.zeros_like(right)
        diagonal = self.matrix.diagonal()
        scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        scaled = sparse.diags(scale) @ self.matrix @ sparse.diags(scale)
        firm = (scaled + LEAST_STIFFNESS * sparse.identity(len(scale))).tocsc()
        factors = splu(firm, permc_spec='MMD_AT_PLUS_A', options={'SymmetricMode': True})
        by_row = scale if right.ndim == 1 else scale[:, None]
        return by_row * factors.solve(by_row * right)


def parts_of(pairs: Integers, count: int) -> Integers:
    """Return the number of the connected part that each cloud is in, (K,); pairs (E, 2)."""
    links = sparse.coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), (count, count))
    return connected_components(links, directed=False)[1]


def anchors_of(part: Integers, held: Mask, anchored: Mask) -> Mask:
    """Return which clouds (K,) do not move: those held, and one of each part that nothing holds.

    anchored: clouds that an absolute prior holds softly.
    """
    fixed = held.copy()
    for number in range(part.max() + 1):
        members = np.flatnonzero(part == number)
        if not (held[members] | anchored[members]).any():
            fixed[members[0]] = True
    return fixed


def system_of(
    linearization: JointLinearization,
    poses: Transforms,
    fixed: Mask,
    prior: tuple[Sequence[PosePrior], Points, float] = ((), np.empty((0, 3)), 1.0),
) -> JointSystem:
    """Return the `JointSystem` at poses, with the fixed clouds (K,) left out.

    prior: what is known of the poses, the clouds' origins in their own frames (K, 3), and what of
        a nat of q_tot is information.
    """
    about = about_middles(poses)
    gradient = np.einsum('kji,kj->ki', about, linearization.pulls)
    a, b = linearization.pairs.T
    blocks = linearization.blocks[:, _PLACES]
    of_a, of_b = blocks @ about[a], blocks @ about[b]
    back_a, back_b = np.swapaxes(about[a], 1, 2), np.swapaxes(about[b], 1, 2)
    both = back_a @ of_b
    entries = [(a, a, back_a @ of_a), (b, b, back_b @ of_b)]
    entries += [(a, b, -both), (b, a, -np.swapaxes(both, 1, 2))]
    entries += _add_priors(*prior, poses, gradient)
    free = np.flatnonzero(~fixed)
    place = np.full(len(poses), -1)
    place[free] = np.arange(len(free))
    return JointSystem(gradient[free].ravel(), _matrix(entries, place, len(free)), free)


def about_middles(poses: Transforms) -> Floats:
    """Return (K, 6, 6): a twist about a cloud's middle as one about the common origin."""
    about = np.tile(np.eye(6), (len(poses), 1, 1))
    about[:, 3:, :3] = [se3.skew(middle) for middle in poses[:, :3, 3]]
    return about


def moved(poses: Transforms, free: Integers, step: Floats) -> Transforms:
    """Return poses (K, 4, 4) after a step (F, 6) of the free ones about their middles."""
    result = poses.copy()
    for k, twist in zip(free, step, strict=True):
        turn = poses[k].copy()
        turn[:3, 3] = 0.0
        result[k] = se3.exp(twist) @ turn
        result[k, :3, 3] += poses[k, :3, 3]
    return result


def _matrix(
    entries: Sequence[tuple[Integers, Integers, Floats]], place: Integers, count: int
) -> Any:
    i = place[np.concatenate([rows for rows, _, _ in entries])]
    j = place[np.concatenate([columns for _, columns, _ in entries])]
    blocks = np.concatenate([block for _, _, block in entries])
    both = (i >= 0) & (j >= 0)
    rows = 6 * i[both, None, None] + np.arange(6)[:, None] + np.zeros((1, 6), int)
    columns = 6 * j[both, None, None] + np.arange(6) + np.zeros((6, 1), int)
    places = rows.ravel(), columns.ravel()
    return sparse.csc_matrix((blocks[both].ravel(), places), (6 * count, 6 * count))


def _add_priors(
    priors: Sequence[PosePrior], origins: Points, nat: float, poses: Transforms, gradient: Floats
) -> list[tuple[Integers, Integers, Floats]]:
    """Add the priors to the gradient (K, 6); return what they add to the matrix."""
    found: list[tuple[Integers, Integers, Floats]] = []
    for prior in priors:
        residual, jacobians = _residual(prior, origins, poses)
        weight = prior.information / nat
        for k, J in jacobians:
            gradient[k] += J.T @ weight @ residual
            found += [
                (np.array([k]), np.array([o]), (J.T @ weight @ L)[None]) for o, L in jacobians
            ]
    return found


def _residual(
    prior: PosePrior, origins: Points, poses: Transforms
) -> tuple[Floats, list[tuple[int, Floats]]]:
    """Return what a pose is off its prior, (6,) (omega, v), and how twists of clouds change it."""
    j, i = prior.source, prior.target
    lever = -poses[j, :3, :3] @ origins[j]  # from the cloud's middle to its frame's origin
    if i is None:
        R, at, J_target = np.eye(3), np.zeros(3), []
    else:
        R = poses[i, :3, :3].T
        at = poses[i, :3, 3] - poses[i, :3, :3] @ origins[i]
        J_target = [(i, -_jacobian(R, poses[j, :3, 3] + lever - poses[i, :3, 3]))]
    error = np.eye(4)
    error[:3, :3] = R @ poses[j, :3, :3] @ prior.transform[:3, :3].T
    off = R @ (poses[j, :3, 3] + lever - at) - prior.transform[:3, 3]
    residual = np.r_[se3.log(error)[:3], off]
    return residual, [(j, _jacobian(R, lever)), *J_target]


def _jacobian(R: Floats, lever: Floats) -> Floats:
    """Return how a turn about a place, and a move, change a frame's pose a lever away."""
    J = np.zeros((6, 6))
    J[:3, :3] = J[3:, 3:] = R
    J[3:, :3] = -R @ se3.skew(lever)
    return J


def _places() -> Integers:
    """Return where in a pair's sums each entry of its block is, (6, 6)."""
    place = np.empty((6, 6), int)
    upper = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
    place[3:, 3:], place[:3, :3] = upper, BLOCK_SUMS - 6 + upper
    place[:3, 3:] = np.arange(6, BLOCK_SUMS - 6).reshape(3, 3)
    place[3:, :3] = place[:3, 3:].T
    return place


_PLACES = _places()
