"""Poses that relations between them agree on best: a sparse graph, solved by Gauss-Newton.

A relation is a `PosePrior`: a pose in another's frame, or in the common one, with its covariance.
"""

# SciPy has no types.
# pyright: reportUnknownMemberType=false

from array import array
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from idem_ros.core.arrays import Floats, Indices, Mask, Points, Transforms
from idem_ros.core.exceptions import InvalidConfig, InvalidTransform
from idem_ros.core.geometry import se3
from idem_ros.core.several.block_factors import BlockFactors, Pattern, factored, pattern_of
from idem_ros.core.several.problem import PosePrior, checked_priors, held_mask
from idem_ros.core.several.system import parts_of

MOST_STEPS = 50
HALVINGS = 6  # of a step that leads up
SHORT = 1e-9  # [rad] and [length]: a step of no use


class PoseGraph(NamedTuple):
    """Poses in one frame, and how well they are known."""

    poses: Transforms  # (K, 4, 4)
    # (K, 6, 6), x y z rx ry rz of each frame's pose, in the common axes, about its own origin,
    # relative to what is held; zero of that
    covariances: Floats
    misfits: Floats  # (E,): of each relation, its squared distance in its own deviations
    converged: bool


def solve_graph(
    poses: ArrayLike, relations: Iterable[PosePrior], held: Sequence[int] = (0,)
) -> PoseGraph:
    """Return the poses nearest to all relations, each weighed by its covariance.

    Args:
        poses: (K, 4, 4) to start from; all that are not held must hang together with one that is,
            or with an absolute relation.
        relations: `PosePrior`s, each looked at once; of each some numbers are kept.
        held: numbers of the poses that stay.

    Raises:
        InvalidConfig: a relation of a pose that there is not, or poses that nothing holds.
        InvalidTransform: a pose is none.
    """
    at = np.array([se3.checked_transform(T, f'pose {k}') for k, T in enumerate(_listed(poses))])
    graph, fixed = _Graph.of(relations, len(at)), held_mask(held, len(at))
    _require_held(graph, fixed)
    free = np.flatnonzero(~fixed)
    covariances = np.zeros((len(at), 6, 6))
    if not len(free):
        return PoseGraph(at, covariances, graph.misfits(at), True)
    places = _places(graph, free, len(at))
    cost, converged = float(graph.misfits(at).sum()), False
    for _ in range(MOST_STEPS):
        gradient, factors = graph.system(at, places)
        step = factors.solved(-gradient)
        at, cost, length = _descended(graph, at, (free, step), cost)
        if length * np.abs(step).max(initial=0.0) < SHORT:
            converged = True
            break
    _, factors = graph.system(at, places)
    covariances[free] = factors.inverse_diagonal()[:, se3.ROS_ORDER][:, :, se3.ROS_ORDER]
    return PoseGraph(at, covariances, graph.misfits(at), converged)


class _Places(NamedTuple):
    """Which poses are free, and where relations between two of them are in the matrix."""

    free: Indices  # (F,)
    inner: Indices  # of the relations between two that are free
    pairs: Indices  # (I, 2): these two, among the free
    pattern: Pattern


class _Graph(NamedTuple):
    """Relations in rows."""

    i: Indices  # (E,): the frame that each is told in; -1: the common one
    j: Indices  # (E,): of whose pose
    T: Transforms  # (E, 4, 4)
    information: Floats  # (E, 6, 6), by (omega, v)

    @classmethod
    def of(cls, relations: Iterable[PosePrior], count: int) -> '_Graph':
        """Return that of relations between so many poses."""
        pairs, T, information = array('q'), array('d'), array('d')
        for relation in relations:
            checked_priors([relation], count)
            pairs.extend((-1 if relation.target is None else relation.target, relation.source))
            T.frombytes(relation.transform.tobytes())
            information.frombytes(relation.information.tobytes())
        i, j = np.array(pairs, int).reshape(-1, 2).T
        matrices = np.array(information).reshape(-1, 6, 6)
        return cls(i, j, np.array(T).reshape(-1, 4, 4), matrices)

    def frames(self, poses: Transforms) -> Transforms:
        """Return the poses (E, 4, 4) of the frames that relations are told in."""
        return np.concatenate([poses, np.eye(4)[None]])[self.i]

    def residuals(self, poses: Transforms) -> Floats:
        """Return how far (E, 6), (omega, v), each pose is from what is told of it."""
        R, at = self.frames(poses)[:, :3, :3], self.frames(poses)[:, :3, 3]
        to = poses[self.j]
        turned = np.einsum('eji,ejk,elk->eil', R, to[:, :3, :3], self.T[:, :3, :3])
        found = np.empty((len(self.j), 6))
        if len(found):  # scipy refuses an empty stack of rotations
            found[:, :3] = Rotation.from_matrix(turned).as_rotvec()
        found[:, 3:] = np.einsum('eji,ej->ei', R, to[:, :3, 3] - at) - self.T[:, :3, 3]
        return found

    def misfits(self, poses: Transforms) -> Floats:
        """Return the squared distances (E,) in the relations' own deviations."""
        off = self.residuals(poses)
        return np.einsum('ei,eij,ej->e', off, self.information, off)

    def system(self, poses: Transforms, places: _Places) -> tuple[Floats, BlockFactors]:
        """Return the gradient (F, 6) and the factors of the matrix, by turns about own origins."""
        of_j, of_i = self._jacobians(poses)
        gradient = np.zeros((len(poses) + 1, 6))  # the last: of the common frame
        own = np.zeros((len(poses) + 1, 6, 6))
        residuals = self.residuals(poses)
        for a, J in ((self.j, of_j), (self.i, of_i)):
            weighed = np.einsum('eji,ejk->eik', J, self.information)
            np.add.at(gradient, a, np.einsum('eij,ej->ei', weighed, residuals))
            np.add.at(own, a, weighed @ J)
        inner = places.inner
        between = np.einsum(
            'eji,ejk,ekl->eil', of_i[inner], self.information[inner], of_j[inner], optimize=True
        )
        factors = factored(places.pattern, places.pairs, between, own[places.free])
        return gradient[places.free], factors

    def _jacobians(self, poses: Transforms) -> tuple[Floats, Floats]:
        """Return how residuals change by a twist of the pose, and of the frame it is told in."""
        frames = self.frames(poses)
        R_t = np.swapaxes(frames[:, :3, :3], 1, 2)
        apart = poses[self.j, :3, 3] - frames[:, :3, 3]
        of_j = np.zeros((len(self.j), 6, 6))
        of_j[:, :3, :3] = of_j[:, 3:, 3:] = R_t
        of_i = -of_j
        of_i[:, 3:, :3] = R_t @ _skews(apart)
        return of_j, of_i


def _descended(
    graph: _Graph, poses: Transforms, move: tuple[Indices, Floats], cost: float
) -> tuple[Transforms, float, float]:
    """Return poses after a step, halved until it leads down, the cost there and its length.

    A length of 0: it leads nowhere.
    """
    free, step = move
    for halving in range(HALVINGS):
        length = 0.5**halving
        tried = _moved(poses, free, length * step)
        there = float(graph.misfits(tried).sum())
        if there <= cost:
            return tried, there, length
    return poses, cost, 0.0


def _moved(poses: Transforms, free: Indices, step: Floats) -> Transforms:
    """Return poses after twists (F, 6) of the free ones about their own origins."""
    result = poses.copy()
    if len(free):
        turns = Rotation.from_rotvec(step[:, :3]) * Rotation.from_matrix(poses[free, :3, :3])
        result[free, :3, :3] = turns.as_matrix()
        result[free, :3, 3] += step[:, 3:]
    return result


def _listed(poses: Any) -> list[Any]:
    try:
        return list(poses)
    except TypeError as error:
        raise InvalidTransform(f'poses is {poses!r}; it must be (K, 4, 4)') from error


def _require_held(graph: _Graph, fixed: Mask) -> None:
    """Refuse poses that no relation leads from to one that is held."""
    is_absolute = graph.i < 0
    part = parts_of(np.column_stack([graph.i, graph.j])[~is_absolute], len(fixed))
    holding = np.isin(part, part[fixed]) | np.isin(part, part[graph.j[is_absolute]])
    if not holding.all():
        number = int(np.argmin(holding))
        raise InvalidConfig(
            f'no relation leads from pose {number} to one that is held; hold it, or give one'
        )


def _places(graph: _Graph, free: Indices, count: int) -> _Places:
    """Return the `_Places` of a graph's relations."""
    place = np.full(count + 1, -1)  # the last: the common frame
    place[free] = np.arange(len(free))
    pairs = np.column_stack([place[graph.i], place[graph.j]])
    inner = np.flatnonzero((pairs >= 0).all(axis=1))
    return _Places(free, inner, pairs[inner], pattern_of(pairs[inner], len(free)))


def _skews(v: Points) -> Floats:
    """Return the matrices (E, 3, 3) of the cross product with vectors (E, 3)."""
    return np.cross(v[:, None, :], np.eye(3)[None]).swapaxes(1, 2)
