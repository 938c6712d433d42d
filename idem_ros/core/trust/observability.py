"""Which motions the surfaces of two clouds determine, and which are unobservable.

A surface determines a motion along its normal. Normals are known to their noise, which in a plane
or a corridor looks like a little of it in every direction. So each ball takes its normal twice,
n_A from the target's points in it and n_B from the source's: their noises are independent, and the
mean of (n_A . motion)(n_B . motion) over the balls is zero, but for chance, where nothing does.

The pattern of a sensor is not independent: a ball with one ring of a LiDAR has the ring's cone for
a surface, in both clouds alike. Such a ball holds a line, and has no normal. Where little is held
wider balls are asked, too, which reach from ring to ring.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Indices,
    Mask,
    Matrix3,
    Matrix6,
    Point,
    Transform,
    Twists,
)
from idem_ros.core.geometry import se3
from idem_ros.core.metric.balls import Balls
from idem_ros.core.solve.cost import JointEntropy
from idem_ros.core.trust.surfaces import ACROSS, PLAIN, SURFACE, Surfaces, surfaces

# Of the mean square along the normals: planes, corridors, poles and spheres leave at most 0.0015
# where they are free, the scenes of `python -m benchmarks accuracy` hold by 0.009 or more, and
# an exact surface may hold by less and yet firmly.
LEAST_STRENGTH = 0.005
# Corners that one ring crosses are flat, too: in `python -m benchmarks tunnels` they leave at most
# 0.001 of motions that are free, and what holds a motion there does so by 0.0015 or more.
LEAST_HELD = 0.0014
FIRM = 0.03  # by a sample: below, all balls are asked, and wider ones
CHANCE = 3.0  # standard errors
NORMAL_VARIANCES = 2.0  # of strength: noise of a normal leaves as much
EXACT = 1e4  # variances of a normal: what is known as well as that is told from any pattern
MOST_TURN = 0.5  # of a unit motion's square: more is a turn
ROUNDING = 1e-9  # what exact surfaces, or no surface at all, leave of the strength of others
LEAST_BALLS = 100  # fewer may happen to lie in one plane
SAMPLE = 1024  # centres of each cloud, about


class Observability(NamedTuple):
    """How firmly each of six motions is determined, the loosest first."""

    strength: Floats  # (6,): mean square of a unit motion along the normals
    error: Floats  # (6,): its standard error
    gentle: Floats  # (6,): what of it surfaces give that a motion moves little; at the least
    noise: float  # mean variance of a normal [rad^2]
    axes: Matrix6  # (6, 6): columns, orthonormal: the motions, made of `units`
    units: Twists  # (6, 6): `unit_motions`, in the frame at the target's origin
    lever_arm: float  # how far from their middle the surfaces reach
    # (balls, 6): how far each motion moves the surface in a ball along its normal
    along: Floats
    centres: tuple[Indices, Indices]  # which of the target's and the source's the balls are
    observable: Mask  # (6,) bool: not where nothing but chance or noise determines it

    @property
    def motions(self) -> Twists:
        """The motions (6, 6): columns (omega, v), each of which moves the surfaces by about 1."""
        return self.units @ self.axes

    @property
    def constrained(self) -> Twists:
        """The motions (6, k) that are observable."""
        return self.motions[:, self.observable]

    @property
    def free(self) -> Twists:
        """The motions (6, k) that are not."""
        return self.motions[:, ~self.observable]

    def ways(self, among: Mask) -> Iterator[tuple[int, Point]]:
        """Yield which of some motions, (6,), move all, and the way, (3,) of unit length.

        The others turn.
        """
        for k in np.flatnonzero(among):
            turn, move = self.axes[:3, k], self.axes[3:, k]
            if turn @ turn <= MOST_TURN:
                yield int(k), move / np.sqrt(move @ move)

    def without(self, direction: Point) -> 'Observability':
        """Return the same, but the motion that is most along a direction, (3,), is not held."""
        seen = self.observable.copy()
        seen[self.most_along(direction)] = False
        return self._replace(observable=seen)

    def confirmed(self, direction: Point) -> 'Observability | None':
        """Return the same, the motion most along a direction held; None: by chance at most."""
        k = self.most_along(direction)
        if self.strength[k] < CHANCE * self.error[k]:
            return None
        seen = self.observable.copy()
        seen[k] = True
        return self._replace(observable=seen)

    def most_along(self, direction: Point) -> int:
        """Return which motion moves all along a direction, (3,), the most."""
        return int(np.argmax(np.abs(direction @ self.axes[3:])))


def observability_of(
    cost: JointEntropy, T_target_source: Transform, wider: Iterable[Balls] = ()
) -> Observability:
    """Return the `Observability` of a cost's two clouds at a transform.

    Of a sample of the centres; where by the sample a motion is not observable for sure, of all.

    Args:
        cost: that of the last stage.
        T_target_source: (4, 4) between the clouds' origins.
        wider: `Balls` that are asked there, too.
    """
    found = _observability(cost, surfaces(cost.balls, T_target_source, SURFACE, SAMPLE))
    if (found.strength < FIRM).any():
        each = [surfaces(balls, T_target_source, PLAIN) for balls in wider]
        found = _observability(cost, surfaces(cost.balls, T_target_source, SURFACE), each)
    return found


def _observability(
    cost: JointEntropy, found: Surfaces, wider: Iterable[Surfaces] = ()
) -> Observability:
    all_ = [found, *wider]
    x = np.concatenate([each.mean for each in all_])
    if len(x) == 0:
        return _without_surfaces(cost, found.T_target_source, found.centres)
    pivot = x.mean(axis=0)
    scatter = (x - pivot).T @ (x - pivot) / len(x)
    lever_arm = max(float(np.sqrt(np.trace(scatter))), cost.balls.radius)
    units = unit_motions(pivot, _turns(scatter, cost.balls.radius))
    a = np.concatenate([each.own for each in all_]) @ units
    b = np.concatenate([each.other for each in all_]) @ units
    noise = float(np.concatenate([each.variance for each in all_]).mean())
    mean = a.T @ b / len(x)
    strength, axes = np.linalg.eigh((mean + mean.T) / 2)
    along = a @ axes
    products = along * (b @ axes)  # their mean is the strength
    error = _standard_error(products)
    little = np.where(np.abs(along) < ACROSS, products, 0.0)
    gentle = little.mean(axis=0) - CHANCE * _standard_error(little)
    turning = np.einsum('ij,ij->j', axes[:3], axes[:3])
    seen = _observable(strength, error, noise, len(x), turning)
    along = along[: len(found.mean)]
    return Observability(
        strength, error, gentle, noise, axes, units, lever_arm, along, found.centres, seen
    )


def _standard_error(products: Floats) -> Floats:
    """Return that of the mean, (6,), of (n, 6)."""
    mean, n = products.mean(axis=0), len(products)
    variance = np.einsum('ij,ij->j', products, products) / n - mean**2
    return np.sqrt(np.maximum(variance, 0.0) / n)


def _observable(
    strength: Floats, error: Floats, noise: float, balls: int, turning: Floats
) -> Mask:
    """Return which motions are observable; turning (6,): how much of each is a turn, 0 to 1."""
    if 0 < balls < LEAST_BALLS:
        return np.ones(6, bool)
    by_chance = np.maximum(CHANCE * error, max(NORMAL_VARIANCES * noise, ROUNDING))
    too_loose = strength + CHANCE * error < LEAST_STRENGTH
    by_pattern = (strength < min(LEAST_HELD, EXACT * noise)) & (turning < MOST_TURN)
    return ~(((strength < by_chance) & too_loose) | by_pattern)


def _without_surfaces(
    cost: JointEntropy, T: Transform, centres: tuple[Indices, Indices]
) -> Observability:
    """Return the `Observability` of clouds without surfaces, such as lines, by their stiffness."""
    pivot, lever_arm = middle_and_arm(cost.balls, T)
    units = unit_motions(pivot, np.eye(3) / lever_arm)
    matrix = cost.linearize(T).matrix
    stiffness, axes = np.linalg.eigh(units.T @ matrix @ units)
    strength = stiffness / stiffness[-1] if stiffness[-1] > 0.0 else np.ones(6)
    error, along = np.zeros(6), np.empty((0, 6))
    seen = _observable(strength, error, 0.0, 0, np.ones(6))
    return Observability(
        strength, error, strength, 0.0, axes, units, lever_arm, along, centres, seen
    )


def unit_motions(pivot: Point, turns: Matrix3) -> Matrix6:
    """Return (6, 6): columns (omega, v) that turn about a pivot by turns (3, 3), or move by 1."""
    units = np.eye(6)
    units[:3, :3] = turns
    units[3:, :3] = se3.skew(pivot) @ turns
    return units


def _turns(scatter: Matrix3, least: float) -> Matrix3:
    """Return (3, 3) rotations that move points of a (3, 3) scatter by 1, root mean square.

    A corridor is turned farther about its axis than across it: its walls are near to that axis.
    """
    squares, axes = np.linalg.eigh(np.trace(scatter) * np.eye(3) - scatter)
    return axes / np.sqrt(np.maximum(squares, least**2)) @ axes.T


def middle_and_arm(balls: Balls, T_target_source: Transform) -> tuple[Point, float]:
    """Return the source's middle in the target's frame, (3,), and how far its points are from it.

    Between the clouds' origins; the arm is a root mean square, and a radius at least.
    """
    middle, square = balls.source_spread()
    return se3.transform_points(T_target_source, middle), max(np.sqrt(square), balls.radius)
