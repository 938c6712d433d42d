"""What a registration returns: the pose, how it came about, what is observable, a verdict."""

from dataclasses import dataclass, field

import numpy as np

from idem_ros.core.arrays import Floats, Mask, Matrix6, Point, Transform, Transforms
from idem_ros.core.geometry import se3
from idem_ros.core.metric.balls import Balls, from_origins
from idem_ros.core.metric.entropy import length_unit
from idem_ros.core.metric.overlap import overlap_of
from idem_ros.core.metric.voxel_size import size_found
from idem_ros.core.solve.descent import Descent
from idem_ros.core.solve.newton import Solution, Termination
from idem_ros.core.solve.pair import Pair
from idem_ros.core.solve.sweep import Sweep
from idem_ros.core.status import Status
from idem_ros.core.trust.agreement import Agreement
from idem_ros.core.trust.observability import Observability
from idem_ros.core.trust.verdict import LEAST_PROBABILITY, Assessment, Verdict


@dataclass(frozen=True, eq=False)
class RegistrationResult:
    """The refined transform, and how well the clouds agree there.

    Three things are told apart: how the iteration ended (`termination`), which motions the clouds
    determine (`observable`), and what is to be thought of the pose (`assessment`). `status` sums
    up the first two in a word; `is_usable` says whether to go on from the pose.
    """

    T_target_source: Transform  # p_target = R p_source + t
    status: Status
    iterations: int = 0  # steps over all stages
    q_tot: float = 0.0  # of the registered clouds (voxel means where voxel_size is given) [nat]
    q_mean: float = 0.0  # q_tot per point that has a neighbour in the other cloud [nat]
    # share of the points that have one: of both clouds', or of a scan's in a map much larger
    overlap: float = 0.0
    radius: float = 0.0  # search radius of the last stage, in the clouds' unit
    # (6, 6), x y z rx ry rz: stiffness against a motion of the source in the target frame
    information: Matrix6 = field(default_factory=lambda: np.zeros((6, 6)))
    # (6, 6), likewise: six motions in rows, the one that the surfaces determine least first
    motions: Matrix6 = field(default_factory=lambda: np.eye(6))
    # (6,) bool: whether anything determines them; the others were left as guessed
    observable: Mask = field(default_factory=lambda: np.ones(6, bool))
    termination: Termination = Termination.NOT_STARTED
    # how likely the solve succeeded, 0 to 1, by its coarse stages; nan: there were none
    confidence: float = float('nan')
    assessment: Assessment | None = None  # None where it was not asked for
    # edge of the voxels, in the clouds' unit, as given or as found; None: points as given
    voxel_size: float | None = None
    overlap_source: float = 0.0  # share of the source's points that have a neighbour
    overlap_target: float = 0.0  # likewise, of the target's points within the source's extent
    # (6,), x y z rx ry rz of the source frame in its own axes during the sweep, a second, that was
    # undone; None: none was
    twist: Floats | None = None
    moved: float = 0.0  # how far that moved the points, the median, in the clouds' unit
    motion_flaw: str = ''  # why a motion that was to be undone was not
    # (S, 4, 4): T_target_source after each step of all stages; none where a motion was solved
    path: Transforms = field(default_factory=lambda: np.empty((0, 4, 4)))

    @property
    def converged(self) -> bool:
        """Whether no step moves the source any more, and every motion is observable."""
        return self.status is Status.CONVERGED

    @property
    def free_motions(self) -> Floats:
        """The motions (k, 6), x y z rx ry rz, that are not observable."""
        return self.motions[~self.observable]

    @property
    def is_usable(self) -> bool:
        """Whether to go on from the pose: as the next guess, on tf, as an answer.

        By the verdict, and where none was asked for by the status. Motions that are not observable
        do not hinder: along them the pose is as it was guessed.
        """
        if not self.observable.any():
            return False
        if self.assessment is None:
            return self.status in (Status.CONVERGED, Status.DEGENERATE)
        is_good = self.assessment.verdict in (Verdict.ALIGNED, Verdict.DEGENERATE)
        return is_good and self.assessment.p_aligned >= LEAST_PROBABILITY


def agreement_at(pair: Pair, balls: Balls, T: Transform) -> tuple[Agreement, float]:
    """Return the `Agreement` of a pair's clouds at T, and q_tot (Eq. 8) of its length scale."""
    both = balls.agreement(T, balls.radius)
    q, reach = (np.concatenate([side[k] for side in both]) for k in range(2))
    sides = both[0].reach, both[1].reach
    overlap = overlap_of(*balls.of, T, balls.radius, sides)
    meeting = min(int(np.count_nonzero(side)) for side in sides)
    found = Agreement(q, reach, meeting, overlap, (both[0].moments, both[1].moments))
    scale = length_unit(pair.config.length_scale, balls.radius)
    if scale == balls.radius:
        return found, float(q.sum())
    return found, sum(float(side.q.sum()) for side in balls.agreement(T, scale))


def result_at(
    pair: Pair, descent: Descent, observability: Observability
) -> tuple[RegistrationResult, Agreement]:
    """Return the `RegistrationResult` of a `Descent`, without an assessment, and the `Agreement`.

    Raises:
        OutOfTime: the pair's workers are late.
    """
    solution, origin = descent.solution, pair.target.origin
    assert descent.cost is not None, 'a result has the radius of its cost'
    agreement, q_tot = agreement_at(pair, descent.cost.balls, solution.transform)
    meeting = int(np.count_nonzero(agreement.reach))
    sweep = descent.sweep or Sweep(pair.source)
    result = RegistrationResult(
        T_target_source=from_origins(pair.target, pair.source, solution.transform),
        status=_status(solution, agreement, observability),
        iterations=descent.iterations,
        q_tot=q_tot,
        q_mean=q_tot / meeting if meeting else 0.0,
        overlap=agreement.overlap.share,
        overlap_source=agreement.overlap.of_source,
        overlap_target=agreement.overlap.of_target,
        radius=descent.cost.balls.radius,
        information=_in_ros_order(solution.matrix, origin),
        motions=(se3.adjoint(se3.translation(origin)) @ observability.motions).T[:, se3.ROS_ORDER],
        observable=observability.observable,
        termination=solution.termination,
        confidence=descent.confidence,
        voxel_size=size_found(pair.config),
        twist=sweep.twist_of_frame(),
        moved=sweep.distance(),
        motion_flaw=sweep.flaw,
        path=from_origins(pair.target, pair.source, np.reshape(descent.path, (-1, 4, 4))),
    )
    return result, agreement


def _status(solution: Solution, agreement: Agreement, observability: Observability) -> Status:
    if agreement.overlap.share == 0.0:
        return Status.NO_OVERLAP
    if solution.termination is Termination.NOT_STARTED:
        return Status.AUDITED
    if solution.singular or not observability.observable.all():
        return Status.DEGENERATE
    return Status(solution.termination.value)


def _in_ros_order(matrix: Matrix6, origin: Point) -> Matrix6:
    """Move the matrix from the target's origin to its frame, and put the translation first."""
    to_origin = se3.adjoint(se3.translation(-origin))
    return (to_origin.T @ matrix @ to_origin)[np.ix_(se3.ROS_ORDER, se3.ROS_ORDER)]
