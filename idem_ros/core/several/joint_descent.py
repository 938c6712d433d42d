"""Follow Newton's steps of all poses at once, stage by stage, in a frame that stays."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Integers, Mask, Point, Points, Transforms
from idem_ros.core.geometry import se3
from idem_ros.core.several.joint_balls import JointBalls
from idem_ros.core.several.joint_covariance import nat_at
from idem_ros.core.several.joint_linearization import JointLinearization, linearized
from idem_ros.core.several.problem import PosePrior
from idem_ros.core.several.system import JointSystem, anchors_of, moved, parts_of, system_of
from idem_ros.core.solve.ball_cost import BallCost
from idem_ros.core.solve.newton import (
    Criteria,
    Termination,
    accept,
    decrement,
    secant,
)
from idem_ros.core.workers import OutOfTime


class Known(NamedTuple):
    """What is known of the poses besides the points."""

    held: Mask  # (K,): poses that do not move
    priors: Sequence[PosePrior]
    origins: Points  # (K, 3): of the clouds, in their own frames

    @property
    def anchored(self) -> Mask:
        """Which clouds (K,) an absolute prior holds."""
        found = np.zeros(len(self.held), np.bool_)
        found[[prior.source for prior in self.priors if prior.target is None]] = True
        return found


class JointSolution(NamedTuple):
    """Where an iteration over all poses ended."""

    poses: Transforms
    iterations: int
    termination: Termination


class JointCost:
    """q_tot of several clouds, and what is known besides, near poses."""

    def __init__(self, balls: JointBalls, ball_cost: BallCost, known: Known) -> None:
        self.balls, self.ball_cost, self.known = balls, ball_cost, known
        self.latest: JointLinearization | None = None
        self.nat = 1.0  # what of a nat of q_tot is information; see `information`

    def weigh_priors(self, poses: Transforms) -> None:
        """Take anew what a nat is worth against the priors, where there are any."""
        if self.known.priors:
            self.nat = nat_at(self, poses)

    def system(self, poses: Transforms, with_priors: bool = True) -> JointSystem:
        """Return the `JointSystem` at poses; each part that nothing holds has one pose held."""
        found = linearized(self.balls, self.ball_cost, poses)
        self.latest = found
        part = self._parts(found)
        fixed = anchors_of(part, self.known.held, self.known.anchored)
        prior = self.known.priors if with_priors else (), self.known.origins, self.nat
        return system_of(found, poses, fixed, prior)

    def parts(self, poses: Transforms) -> Integers:
        """Return the number of the part that each cloud hangs together with others in, (K,).

        By the linearisation that there is, where there is one: it was near enough.
        """
        return self._parts(self.latest or linearized(self.balls, self.ball_cost, poses))

    def with_fixed(self, fixed: Mask) -> 'JointCost':
        """Return the same cost of which other clouds (K,) are held."""
        cost = JointCost(self.balls, self.ball_cost, self.known._replace(held=fixed))
        cost.nat = self.nat
        return cost

    def sampled(self, most_centres: float) -> 'JointCost':
        """Return about the same cost, of balls around so many centres."""
        cost = JointCost(self.balls.thinner(most_centres), self.ball_cost, self.known)
        cost.nat = self.nat
        return cost

    def _parts(self, found: JointLinearization) -> Integers:
        links = [found.pairs[found.blocks[:, 3] > 0.0]]
        links += [
            np.array([[prior.source, prior.target]])
            for prior in self.known.priors
            if prior.target is not None
        ]
        return parts_of(np.concatenate(links), self.balls.count)


class _Move(NamedTuple):
    poses: Transforms  # before it
    free: Integers
    step: Floats  # Newton's there
    left: float  # the decrement there


def minimize_all(cost: JointCost, poses: Transforms, criteria: Criteria) -> JointSolution:
    """Follow over-relaxed Newton steps until one is short for every cloud.

    As `newton.minimize` does for one pose; steps are measured against the pose that is held.
    """
    tuning = criteria.tuning
    relaxation, last, iteration = 1.0, None, 0
    try:
        for iteration in range(1, criteria.max_iterations + 1):
            system = cost.system(poses)
            step = system.step()
            left = decrement(system.gradient, step.ravel())
            if last is not None and not accept(left, last.left, relaxation):
                relaxation, poses = 1.0, moved(last.poses, last.free, last.step)
                continue
            if last is not None and np.array_equal(last.free, system.free):
                found = secant(relaxation, last.step.ravel(), step.ravel(), system.matrix)
                relaxation = found if iteration <= tuning.patience else min(found, relaxation)
            last = _Move(poses, system.free, step, left)
            poses = moved(poses, system.free, relaxation * step)
            if _is_short(step if iteration <= tuning.patience else relaxation * step, criteria):
                return JointSolution(poses, iteration, Termination.CONVERGED)
            if criteria.workers.are_late():
                raise OutOfTime
    except OutOfTime:
        return JointSolution(poses, iteration, Termination.LATE)
    return JointSolution(poses, iteration, Termination.MAX_ITERATIONS)


def _is_short(step: Floats, criteria: Criteria) -> bool:
    turns, moves = (np.linalg.norm(part, axis=1).max(initial=0.0) for part in np.split(step, 2, 1))
    return bool(turns <= criteria.rotation and moves <= criteria.translation)


class Gauge(NamedTuple):
    """What stays, and the motions that put solved poses where it is."""

    fixed: Mask  # (K,): clouds whose poses are as given
    motions: Transforms  # (K, 4, 4): of each cloud, the same for all of a part

    def poses(self, solved: Transforms, origins: Points, given: Transforms) -> Transforms:
        """Return poses (K, 4, 4) of the clouds' frames; those fixed are as given, to the bit."""
        result = self.motions @ solved
        result[:, :3, 3] -= np.einsum('kij,kj->ki', result[:, :3, :3], origins)
        result[self.fixed] = given[self.fixed]
        return result

    def covariance(self, of_solved: Floats) -> Floats:
        """Return a covariance (6 K, 6 K), by frames' poses, in the axes of the gauge."""
        turned = np.zeros_like(of_solved)
        for k, R in enumerate(self.motions[:, :3, :3]):
            for at in (6 * k, 6 * k + 3):
                turned[at : at + 3] = R @ of_solved[at : at + 3]
        for k, R in enumerate(self.motions[:, :3, :3]):
            for at in (6 * k, 6 * k + 3):
                turned[:, at : at + 3] = turned[:, at : at + 3] @ R.T
        return turned


def gauge_of(
    part: Integers,
    known: Known,
    held: Sequence[int],
    numbers: Sequence[int],
    poses: tuple[Transforms, Transforms],
    offset: Point,
) -> Gauge:
    """Return the `Gauge`: each part has what is held in it, or its first cloud, where it was.

    Args:
        part: (K,) which part each cloud is in.
        known: what the solve was held by.
        held: the clouds that are to stay.
        numbers: those that the clouds were given by: the least is a part's first.
        poses: (K, 4, 4) each, at the start and where the solve ended.
        offset: (3,) that both were moved by, to be near zero.
    """
    fixed, motions = known.held.copy(), np.tile(se3.translation(offset), (len(part), 1, 1))
    start, end = poses
    for number in range(part.max() + 1):
        members = np.flatnonzero(part == number)
        if (known.held[members] | known.anchored[members]).any():
            continue
        stays = min(members.tolist(), key=lambda k: (k not in held, numbers[k]))
        fixed[stays] = True
        motions[members] = motions[stays] @ start[stays] @ se3.inverse(end[stays])
    return Gauge(fixed, motions)
