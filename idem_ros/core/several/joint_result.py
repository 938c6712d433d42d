"""What a joint registration returns: poses, their covariance, the graph of overlaps, verdicts."""

from dataclasses import dataclass

from idem_ros.core.arrays import Floats, Matrix6, Transforms, Twist
from idem_ros.core.solve.newton import Termination
from idem_ros.core.status import Status
from idem_ros.core.trust.verdict import Verdict

USABLE = Verdict.ALIGNED, Verdict.DEGENERATE


@dataclass(frozen=True, eq=False)
class Edge:
    """Two clouds that meet where the poses put them."""

    i: int
    j: int
    overlap: float  # share of both clouds' points that have a neighbour in the other
    q_mean: float  # q_tot of the two alone per such point [nat]
    verdict: Verdict | None = None  # on the two alone; None where it was not asked for
    p_aligned: float = float('nan')
    reason: str = ''
    # (6, 6), x y z rx ry rz, of what the two alone say: of cloud j's pose in the axes of cloud i,
    # about j's origin; None where it was not asked for, or they cannot tell
    covariance: Matrix6 | None = None
    # (6,), x y z rx ry rz, in the same axes about the same place: of j's pose from where the two
    # alone would have it, along what they hold; None where it was not audited
    gap: Twist | None = None


@dataclass(frozen=True)
class CloudVerdict:
    """What is to be thought of one cloud's pose, by the clouds that it meets."""

    verdict: Verdict
    p_aligned: float  # of the weakest edge on the best way to the held cloud
    reason: str


@dataclass(frozen=True, eq=False)
class JointResult:
    """Poses of several clouds into one frame, and how well the clouds agree there."""

    poses: Transforms  # (K, 4, 4): cloud frame to the common frame; what is held is as it was
    # (6 K, 6 K), x y z rx ry rz of each frame's pose, in the common frame's axes, about the
    # frame's own origin; zero for what is held: relative to that
    covariance: Floats
    held: tuple[int, ...]  # clouds that did not move: those asked for, else one of each part
    status: Status
    termination: Termination
    iterations: int = 0  # steps over all stages
    q_tot: float = 0.0  # Eq. 8 over the union of all clouds, on their voxels [nat]
    q_means: tuple[float, ...] = ()  # of each cloud: q_i in the union per point that meets another
    edges: tuple[Edge, ...] = ()  # the overlap graph, by number
    verdicts: tuple[CloudVerdict, ...] = ()  # of each cloud; none where not asked for
    parts: tuple[tuple[int, ...], ...] = ()  # clouds that hang together; solved each by itself
    radius: float = 0.0  # search radius of the last stage, in the clouds' unit
    voxel_size: float | None = None  # edge of the voxels; None: points as given

    @property
    def converged(self) -> bool:
        """Whether no step moves any cloud any more."""
        return self.status is Status.CONVERGED

    @property
    def is_connected(self) -> bool:
        """Whether all clouds hang together."""
        return len(self.parts) == 1

    @property
    def usable(self) -> tuple[bool, ...]:
        """Whether to go on from the pose of each cloud; by status where no verdict was asked."""
        if not self.verdicts:
            return (self.converged,) * len(self.poses)
        return tuple(said.verdict in USABLE for said in self.verdicts)

    @property
    def is_usable(self) -> bool:
        """Whether to go on from all poses, relative to one another."""
        return self.is_connected and all(self.usable)
