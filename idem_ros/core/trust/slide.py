"""How far along a direction surfaces must slide until those that lie across it coincide.

Where most of a scene slides along itself, what holds it are a few surfaces: the sides of niches,
posts, the fronts of boxes. Each of the target votes with each like it of the source, beside which
it lies, for the way between the two. The right way has the votes of all of them at once; any other
those that happen to agree.
"""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Point, Points, Transform
from idem_ros.core.geometry import se3
from idem_ros.core.jit import kernel
from idem_ros.core.trust.surfaces import ACROSS

ALIKE = 0.8  # least cosine between two normals
BIN, BLUR = 0.075, (0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25)  # of the radius; weights of bins
MOST = 2000  # surfaces of either cloud
MOST_WAYS = 1 << 18  # to either side: 20 000 radii, where the clouds of no scan reach so far
# Without a rival, bare tunnels, facades and planes give up to 8 votes where no pattern coincides,
# and with one 18 (`python -m benchmarks tunnels`).
LEAST_VOTES, MOST_RIVAL, MANY_VOTES = 9.0, 0.5, 18.0


class Slide(NamedTuple):
    """How far to slide the source, and what is for it."""

    way: float  # along the direction, in the clouds' unit
    votes: float
    rival: float  # votes for the next best way, two radii or more from it
    of_each: Floats  # votes for each way, the middle one none
    width: float  # between two of those ways

    def rises(self, way: float, near: float, around: float) -> float:
        """Return by how much votes near a way exceed what is usual around it, over what most do.

        Above 1 nowhere; 1 where all are alike.
        """
        off = np.abs(self.width * (np.arange(len(self.of_each)) - len(self.of_each) // 2) - way)
        usual = float(np.median(self.of_each[off <= around])) if (off <= around).any() else 0.0
        if usual >= self.votes:
            return 1.0
        most = float(self.of_each[off <= near].max(initial=0.0))
        return (most - usual) / (self.votes - usual)

    def is_clear(self, near: float = 0.0) -> bool:
        """Whether it has more votes than chance gives, and no rival.

        One of many votes that is less than near may have one: the sides of a box vote for each
        other, too.
        """
        if self.rival <= MOST_RIVAL * self.votes:
            return self.votes >= LEAST_VOTES
        return self.votes >= MANY_VOTES and abs(self.way) < near


def slide_along(
    target: tuple[Points, Points],
    source: tuple[Points, Points],
    T_target_source: Transform,
    direction: Point,
    radius: float,
    reach: float,
) -> Slide:
    """Return the `Slide` of the source from a pose.

    Args:
        target: places and normals, (n, 3), of surfaces as `own_surfaces` gives them.
        source: likewise.
        T_target_source: (4, 4) the pose, between the clouds' origins.
        direction: (3,) of unit length, in the target's frame.
        radius: how far beside the way two surfaces may lie.
        reach: how far to either side at most, in the clouds' unit.
    """
    R = T_target_source[:3, :3]
    source = se3.transform_points(T_target_source, source[0]), source[1] @ R.T
    (here, more), (there, more_there) = (_across(*each, direction) for each in (target, source))
    width = BIN * radius
    votes = np.zeros(2 * int(min(np.ceil(reach / width), MOST_WAYS)) + 1)
    _vote(here, there, np.ascontiguousarray(direction), radius, width, votes)
    votes = more * more_there * np.convolve(votes, BLUR, 'same')
    best = int(np.argmax(votes))
    apart = np.abs(np.arange(len(votes)) - best) * width > 2.0 * radius
    rival = float(votes[apart].max(initial=0.0))
    return Slide((best - len(votes) // 2) * width, float(votes[best]), rival, votes, width)


def _across(points: Points, normals: Points, direction: Point) -> tuple[Floats, float]:
    """Return place and normal (n, 6) of surfaces across a direction, and what each stands for."""
    across = np.flatnonzero(np.abs(normals @ direction) > ACROSS)
    some = across[:: max(len(across) // MOST, 1)]
    return np.hstack([points[some], normals[some]]), len(across) / max(len(some), 1)


@kernel
def _vote(
    here: Floats, there: Floats, u: Point, radius: float, width: float, votes: Floats
) -> None:
    """Add each pair's vote to the bin of the way that brings the source's surface to the other."""
    middle = len(votes) // 2
    a: Floats
    b: Floats
    for i in range(len(here)):
        a = here[i]
        ha = a[3] * u[0] + a[4] * u[1] + a[5] * u[2]
        for j in range(len(there)):
            b = there[j]
            if a[3] * b[3] + a[4] * b[4] + a[5] * b[5] < ALIKE:
                continue
            x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
            along = x * u[0] + y * u[1] + z * u[2]
            if x * x + y * y + z * z - along * along > radius * radius:
                continue
            way = (x * a[3] + y * a[4] + z * a[5]) / ha
            k = int(np.floor(way / width + 0.5)) + middle
            if abs(way - along) < radius and 0 <= k < len(votes):
                hb = b[3] * u[0] + b[4] * u[1] + b[5] * u[2]
                votes[k] += abs(ha * hb)
