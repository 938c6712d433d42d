"""The region of interest (Eq. 14): what lies within the crown of maxima of q_tot around a pose.

    q_IDEM = min (q_tot)_ROI                                                            (Eq. 14)

q_tot is 0 in perfect overlap and 0 again where the clouds are apart. In between it rises to a
crown of maxima; a descent that starts within the crown ends at the alignment. The paper speaks of
the region "located between the peaks of the function" and gives no rule for it. Ours:

- Along an axis, the region ends at the nearest maximum on either side. A fall by less than a
  twentieth of the range of q_tot on that side, before it rises again, is a ripple and no maximum.
- On a grid, a point is inside if the way from it to the pose leads over a lower pass than any way
  to the edge of the grid: the watershed between the pose and the edge. On one axis that is the
  highest maximum on either side. Ripples inside do not matter, and no threshold is needed; but
  the grid must reach beyond the crown.
"""

# SciPy has no types.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse import csgraph

from idem_ros.core.arrays import Floats, Mask
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.geometry import se3
from idem_ros.core.metric.landscape import AXES, Landscape, centroid, displaced
from idem_ros.core.metric.measured_points import usual

RIPPLE = 0.05  # of the range of q_tot on one side of an axis
STEPS_PER_RADIUS = 20  # along an axis
FARTHEST = 8.0  # radii that an axis is looked along


@dataclass(frozen=True)
class AxialRegion:
    """How far the region of interest reaches along and around each axis of `AXES`.

    nan, in `extent` and in `crown`, where q_tot reaches no maximum as far as it was looked at.
    """

    extent: Floats  # (6, 2): to the maxima below and above the pose, [length] and [rad]
    crown: Floats  # (6, 2): q_tot at these maxima [nat]
    q_pose: float  # q_tot at the pose [nat]
    step: Floats  # (6,): between the offsets looked at; the extents are multiples of it

    @property
    def closed(self) -> bool:
        """Whether a maximum was found on either side of every axis."""
        return bool(np.isfinite(self.extent).all())


@dataclass(frozen=True)
class GridRegion:
    """The part of a grid that lies within the crown of maxima around a pose."""

    inside: Mask  # the shape of the grid
    measure: float  # area or volume of the region, in the units of the spacing
    lowest_pass: float  # q_tot where the crown is lowest [nat]
    q_idem: float  # Eq. 14: the least q_tot inside [nat]
    minimum: tuple[int, ...]  # index of the point where it is reached
    closed: bool  # False: the region reaches the edge of the grid; its measure is a lower bound


def region_along_axes(
    landscape: Landscape, T_target_source: ArrayLike | None = None, farthest: float | None = None
) -> AxialRegion:
    """Return the `AxialRegion` around a pose: the nearest maxima along and around three axes.

    Args:
        landscape: the `Landscape` of the two clouds.
        T_target_source: (4, 4) the pose; None: identity.
        farthest: how far the source's points are moved, in the clouds' unit; None: 8 radii.
            Rotations are around the source's centroid, by this length over the root mean square
            distance of the points from it, and by pi at most.

    Raises:
        InvalidTransform: the pose is not a rigid transform.
        InvalidConfig: the radius is 0, or `farthest` is no length above 0.
    """
    T = np.eye(4) if T_target_source is None else se3.checked_transform(T_target_source)
    step, n_steps = _steps(landscape, farthest)
    sides = np.multiply.outer((-1.0, 1.0), np.arange(n_steps + 1))  # (2, S + 1)
    offsets = np.zeros((len(AXES), *sides.shape, len(AXES)))
    for k in range(len(AXES)):
        offsets[k, :, :, k] = sides * step[k]
    transforms = displaced(T, offsets.reshape(-1, len(AXES)), centroid(landscape, T))
    q = landscape.at(transforms).reshape(offsets.shape[:-1])
    extent, crown = np.full((2, len(AXES), 2), np.nan)
    for k, side in np.ndindex(extent.shape):
        peak = nearest_maximum(q[k, side])
        if peak is not None:
            extent[k, side], crown[k, side] = sides[side, peak] * step[k], q[k, side, peak]
    return AxialRegion(extent, crown, float(q[0, 0, 0]), step)


def nearest_maximum(q: ArrayLike) -> int | None:
    """Return the index of the first maximum of q (S,) that is no ripple; None if there is none."""
    q = np.asarray(q, dtype=np.float64)
    highest = np.maximum.accumulate(q)
    fallen = q < highest - RIPPLE * np.ptp(q)
    return int(np.argmax(q[: np.argmax(fallen)])) if fallen.any() else None


def region_on_grid(
    q: ArrayLike, spacing: ArrayLike, pose: Sequence[int] | None = None
) -> GridRegion:
    """Return the `GridRegion` around a pose.

    Args:
        q: q_tot on a grid of one to three axes, of at least three points each.
        spacing: between the points along each axis; a number, or one for each.
        pose: index of the pose, within the edge of the grid; None: the middle of the grid.

    Raises:
        InvalidConfig: too few points, values that are not finite, or a pose that is not inside.
    """
    q, pose = _checked_grid(q, pose)
    inside, lowest_pass = _watershed(q, pose)
    within = np.where(inside, q, np.inf)
    minimum = np.unravel_index(np.argmin(within), q.shape)
    rim = np.ones(q.shape, bool)
    rim[(slice(2, -2),) * q.ndim] = False
    cell = float(np.prod(np.broadcast_to(spacing, q.ndim)))
    return GridRegion(
        inside=inside,
        measure=int(inside.sum()) * cell,
        lowest_pass=float(lowest_pass),
        q_idem=float(q[minimum]),
        minimum=tuple(int(i) for i in minimum),
        closed=not (inside & rim).any(),
    )


def _steps(landscape: Landscape, farthest: float | None) -> tuple[Floats, int]:
    """Return the step along each axis (6,) and how many there are on a side."""
    if landscape.radius == 0.0:
        raise InvalidConfig(
            'the radius is 0, the points lie all in one place: q_tot is 0 anywhere'
        )
    farthest = FARTHEST * landscape.radius if farthest is None else farthest
    if not (np.isfinite(farthest) and farthest > 0):
        raise InvalidConfig(f'farthest is {farthest!r}; it must be a length above 0')
    n_steps = max(2, int(np.ceil(STEPS_PER_RADIUS * farthest / landscape.radius)))
    points = usual(landscape.source.points)
    lever = np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1)))
    angle = min(np.pi, farthest / lever) if lever > 0 else np.pi
    return np.repeat((farthest, angle), 3) / n_steps, n_steps


def _checked_grid(q: ArrayLike, pose: Sequence[int] | None) -> tuple[Floats, tuple[int, ...]]:
    q = np.asarray(q, dtype=np.float64)
    if q.ndim not in (1, 2, 3) or min(q.shape) < 3:
        raise InvalidConfig(f'the grid has shape {q.shape}; 1 to 3 axes of 3 points at least')
    if not np.isfinite(q).all():
        raise InvalidConfig('the grid holds values that are not finite')
    pose = tuple(n // 2 for n in q.shape) if pose is None else tuple(int(i) for i in pose)
    if len(pose) != q.ndim or not all(0 < i < n - 1 for i, n in zip(pose, q.shape, strict=True)):
        raise InvalidConfig(f'the pose {pose} does not lie within the edge of a grid {q.shape}')
    return q, pose


def _watershed(q: Floats, pose: tuple[int, ...]) -> tuple[Mask, float]:
    """Return which points are on the pose's side, and the value of the lowest pass.

    The passes between any two points are those along the minimum spanning tree of the grid, whose
    edges weigh as much as their higher end. The way from the pose to the edge of the grid (one
    node more) is cut where it is highest.
    """
    outside, start = q.size, int(np.ravel_multi_index(pose, q.shape))
    tree = csgraph.minimum_spanning_tree(_passes(q))
    _, before = csgraph.breadth_first_order(tree, outside, directed=False)
    way = [start]
    while way[-1] != outside:
        way.append(before[way[-1]])
    a, b = np.array(way[:-1]), np.array(way[1:])
    tree = (tree + tree.T).tolil()
    weights = np.array([tree[i, j] for i, j in zip(a, b, strict=True)])
    cut = int(np.argmax(weights))
    tree[a[cut], b[cut]] = tree[b[cut], a[cut]] = 0.0
    _, part = csgraph.connected_components(tree.tocsr(), directed=False)
    ends = [i for i in (a[cut], b[cut]) if i != outside]
    return (part[:-1] == part[start]).reshape(q.shape), q.ravel()[ends].max()


def _passes(q: Floats) -> Any:
    """Return the graph of a grid's neighbours and of its edge with the outside, the last node.

    Weights are ranks, above 0 and all different: first that of the higher end, then of the lower,
    so that a point of the crown itself goes to its lower side.
    """
    n = q.size
    rank = np.empty(n + 1)
    rank[np.argsort(q, axis=None, kind='stable')] = np.arange(1, n + 1)
    rank[n] = 0
    index = np.arange(n).reshape(q.shape)
    ends = [
        (np.take(index, range(m - 1), k).ravel(), np.take(index, range(1, m), k).ravel())
        for k, m in enumerate(q.shape)
    ]
    edge = np.ones(q.shape, bool)
    edge[(slice(1, -1),) * q.ndim] = False
    ends.append((index[edge], np.full(edge.sum(), n)))
    a, b = (np.concatenate(side) for side in zip(*ends, strict=True))
    weights = np.maximum(rank[a], rank[b]) * (n + 1) + np.minimum(rank[a], rank[b])
    return sparse.csr_matrix((weights, (a, b)), (n + 1, n + 1))
