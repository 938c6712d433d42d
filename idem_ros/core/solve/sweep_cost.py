"""The cost of a source that moves during its sweep: of two poses, at the sweep's begin and end.

A point of the time s, 0 at the begin and 1 at the end, has the pose T(s) = T_0 exp(s xi), with
xi = log(T_0^-1 T_1). Twists on the left of T_0 and T_1 move it by (1 - s) of the one and s of the
other: a ball whose source points have the mean time s has J = [(1 - s) J, s J] in place of J.
"""

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Integers,
    Integers32,
    Transform,
    Transforms,
    Twists,
)
from idem_ros.core.jit import kernel
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.candidates import SKIN, CandidatePairs
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.solve.block_sums import SUMS, of_both
from idem_ros.core.solve.centre_groups import dealt_out
from idem_ros.core.solve.cost import JointEntropy, Linearization
from idem_ros.core.solve.linearization import NOT_MET, linearize
from idem_ros.core.solve.pair import Pair, Stage
from idem_ros.core.solve.sweep import Sweep
from idem_ros.core.workers import in_threads

BINS = 32  # of the sweep: balls of like times are added up together
MIDDLES = (np.arange(BINS) + 0.5) / BINS
MOST_SHIFT = 0.2 * SKIN  # of the radius: from here on balls are made anew, with their own moments


class MovingCost:
    """A stage's cost as a function of the poses (2, 4, 4) at the sweep's begin and end.

    Args:
        pair: `Pair`; its source gives way to that of the sweep.
        stage: one of its stages.
        sweep: `Sweep` where the stage begins.

    Attributes:
        sweep: the same at the latest poses.
    """

    def __init__(self, pair: Pair, stage: Stage, sweep: Sweep) -> None:
        source, target, size = sweep.undone(), pair.target, stage.voxel_size
        if size is not None:
            source, target = source.reduced(size), target.reduced(size)
        self.sweep, self._of_stage = sweep, sweep.of_undone(source)
        self._pair, self._stage = pair._replace(target=target), stage._replace(voxel_size=None)
        self._begin_anew(source)

    def at(self, poses: Transforms) -> tuple[JointEntropy, Transform, Sweep]:
        """Return the cost of the source as it lies at the poses, and what they are.

        A `JointEntropy` for rigid motions, the pose at the reference, and the `Sweep`.

        Raises:
            OutOfTime: the workers of the balls are late.
        """
        T, twist = self.sweep.read(poses)
        self.sweep = self.sweep._replace(twist=twist)
        points, balls = self.sweep.moved(self._measured, self._times, twist), self._cost.balls
        farthest = _farthest(points, self._start)
        if farthest > MOST_SHIFT * balls.radius:
            self._begin_anew(self._of_stage._replace(twist=twist).undone())
        else:
            balls.shift_source(points, farthest)
        return self._cost, T, self.sweep

    def linearize(self, poses: Transforms) -> Linearization:
        """Return gradient (12,) and matrix (12, 12), for twists on the left of both poses.

        Raises:
            OutOfTime: the workers of the balls are late.
        """
        cost, T, _ = self.at(poses)
        balls = cost.balls
        self._sort_into_bins(balls, T)
        sums = tuple(np.zeros((2, 1, BINS, SUMS)))
        what = balls.sides(T), NOT_MET, T[None], cost.ball_cost
        in_threads(
            balls.workers, lambda share: linearize(*what, share, self._bin, sums), self._shares
        )
        _, gradients, matrices = of_both(sums[0], sums[1], T[None])
        found = of_two_poses(gradients[None], matrices[None], MIDDLES)
        return Linearization(found.gradient[0], found.matrix[0])

    def _begin_anew(self, source: Cloud) -> None:
        """Make the balls of the stage's source as it lies, with their own moments."""
        self._cost = self._pair._replace(source=source).cost(self._stage)
        lying, measured = self._cost.balls.source, self._of_stage.measured
        assert measured.times is not None, 'a sweep has times'
        self._times, self._start = measured.times[lying.order], lying.grid.points
        self._measured = measured.points[lying.order]
        self._binned: CandidatePairs | None = None

    def times_of_centres(self, T: Transform, parts: int) -> tuple[Integers, Integers]:
        """Return which part of the sweep each centre belongs to, of the target and of the source.

        By the mean time of the source's candidates for its ball at T; by its own.
        """
        begin, scale = self.sweep.begin, parts / (self.sweep.end - self.sweep.begin)
        of_target = self._cost.balls.pairs(T).of_target
        here = _parts(_means(*of_target, self._times), begin, scale, parts)
        return here, _parts(self._times, begin, scale, parts)

    def _sort_into_bins(self, balls: Balls, T: Transform) -> None:
        """Find which centres are of like times, and how they are shared among threads."""
        pairs = balls.pairs(T)
        if pairs is self._binned:
            return
        self._bin = self.times_of_centres(T, BINS)
        self._shares = dealt_out(self._bin, BINS, balls.workers)
        self._binned = pairs


def of_two_poses(gradients: Floats, matrices: Floats, times: Floats) -> Linearization:
    """Return gradients (N, 12) and matrices (N, 12, 12) of two poses, by those of like times.

    Args:
        gradients: (N, G, 6), for a twist that moves points of a time.
        matrices: (N, G, 6, 6), likewise.
        times: (G,), 0 at the first pose, 1 at the second.
    """
    share = np.stack([1.0 - times, times])
    both = share[:, None] * share[None]
    gradient = np.einsum('ag,ngi->nai', share, gradients)
    matrix = np.einsum('abg,ngij->naibj', both, matrices)
    return Linearization(gradient.reshape(-1, 12), matrix.reshape(-1, 12, 12))


def of_common_twist(linearization: Linearization) -> Linearization:
    """Return the sums (6,) and (6, 6) of (N, 12) and (N, 12, 12), for one twist of both poses."""
    gradient = linearization.gradient.sum(axis=0).reshape(2, 6).sum(axis=0)
    matrix = linearization.matrix.sum(axis=0).reshape(2, 6, 2, 6).sum(axis=(0, 2))
    return Linearization(gradient, matrix)


def of_each_pose(motions: Twists) -> Floats:
    """Return motions (12, 2 k) of two poses: those (6, k), of the first and of the second."""
    rows, columns = motions.shape
    result = np.zeros((2 * rows, 2 * columns))
    result[:rows, :columns] = result[rows:, columns:] = motions
    return result


@kernel
def _parts(times: Floats, begin: float, scale: float, parts: int) -> Integers:
    result = np.empty(times.shape[0], np.int64)
    for i in range(times.shape[0]):
        result[i] = min(max(np.int64((times[i] - begin) * scale), 0), parts - 1)
    return result


@kernel
def _means(first: Integers, member: Integers32, times: Floats) -> Floats:
    """Return the mean time, (N,), of the candidates of each centre; any, where it has none."""
    result = np.empty(first.shape[0] - 1)
    for i in range(result.shape[0]):
        total = 0.0
        for c in range(first[i], first[i + 1]):
            total += times[member[c]]
        result[i] = total / max(first[i + 1] - first[i], 1)
    return result


@kernel
def _farthest(points: Floats, start: Floats) -> float:
    """Return the greatest distance of two (N, 3) points of a row."""
    most = 0.0
    for i in range(points.shape[0]):
        square = 0.0
        for c in range(3):
            square += (points[i, c] - start[i, c]) ** 2
        most = max(most, square)
    return np.sqrt(most)
