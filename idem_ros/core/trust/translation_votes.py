"""How far along a direction surfaces must slide until those that lie across it coincide.

Where most of a scene slides along itself, what holds it are a few surfaces: the sides of niches,
posts, the fronts of boxes. Each of the target votes with each like it of the source, beside which
it lies, for the way between the two. The right way has the votes of all of them at once; any other
those that happen to agree.
"""

from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import Floats, Integers, Point, Points, Transform
from idem_ros.core.jit import inlined, kernel
from idem_ros.core.trust.surfaces import ACROSS

ALIKE = 0.8  # least cosine between two normals
BIN, BLUR = 0.075, (0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25)  # of the radius; weights of bins
MOST = 2000  # surfaces of either cloud
PARTS = 32  # of a sweep: surfaces of like times are moved together
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
    width = BIN * radius
    nobody = np.zeros(len(source[0]), np.int64)
    votes = _votes(target, (*source, nobody), T_target_source, direction, (radius, reach), 1)
    votes = np.convolve(votes[0], BLUR, 'same')
    best = int(np.argmax(votes))
    apart = np.abs(np.arange(len(votes)) - best) * width > 2.0 * radius
    rival = float(votes[apart].max(initial=0.0))
    return Slide((best - len(votes) // 2) * width, float(votes[best]), rival, votes, width)


def smear_along(
    target: tuple[Points, Points],
    source: tuple[Points, Points, Integers],
    T_target_source: Transform,
    direction: Point,
    reach: tuple[float, float],
    fraction: float,
) -> float:
    """Return how far a sensor went along a direction during its sweep, beside what was undone.

    Surfaces of each part of the sweep vote on their own. Of all ways and smears, it is the smear
    by which the parts agree best.

    Args:
        target, T_target_source, direction: as of `slide_along`.
        source: likewise, and which of `PARTS` of the sweep each surface is of, (n,).
        reach: the radius, and how far the way and the smear reach to either side at most.
        fraction: the place in the sweep of the instant that the pose is of, 0 to 1.
    """
    votes = _votes(target, source, T_target_source, direction, reach, PARTS)
    steps = votes.shape[1] // 2
    after = (np.arange(PARTS) + 0.5) / PARTS - fraction
    smears = range(-steps, steps + 1, 2)  # [bins]: one apart at the ends of the sweep
    most = [np.convolve(_sheared(votes, smear * after), BLUR, 'same').max() for smear in smears]
    return BIN * reach[0] * smears[int(np.argmax(most))]


def _sheared(votes: Floats, by: Floats) -> Floats:
    """Return the sum of the rows of votes, each brought forward by so many bins."""
    total, size = np.zeros(votes.shape[1]), votes.shape[1]
    steps: list[int] = np.round(by).astype(int).tolist()
    for row, bins in zip(votes, steps, strict=True):
        low, high = max(bins, 0), size + min(bins, 0)
        total[low - bins : high - bins] += row[low:high]
    return total


def _votes(
    target: tuple[Points, Points],
    source: tuple[Points, Points, Integers],
    T_target_source: Transform,
    direction: Point,
    reach: tuple[float, float],
    count: int,
) -> Floats:
    """Return the votes (count, 2 K + 1) for each way, of surfaces of each part of the source."""
    radius, farthest = reach
    width = BIN * radius
    votes = np.zeros((count, 2 * int(min(np.ceil(farthest / width), MOST_WAYS)) + 1))
    of_pose = np.ascontiguousarray(T_target_source), np.ascontiguousarray(direction)
    here = np.ascontiguousarray(target[0]), np.ascontiguousarray(target[1])
    there = np.ascontiguousarray(source[0]), np.ascontiguousarray(source[1]), source[2]
    _vote(here, there, of_pose, radius, width, votes)
    return votes


@kernel
def _vote(
    target: tuple[Points, Points],
    source: tuple[Points, Points, Integers],
    of_pose: tuple[Transform, Point],
    radius: float,
    width: float,
    votes: Floats,
) -> None:
    """Add each pair's vote to the bin of the way that brings the source's surface to the other.

    In the row of its part.
    """
    (T, u), (places, normals, part), middle = of_pose, source, votes.shape[1] // 2
    here, _, more = _across(target[0], target[1], np.eye(4), u)
    there, some, more_there = _across(places, normals, T, u)
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
            if abs(way - along) < radius and 0 <= k < votes.shape[1]:
                hb = b[3] * u[0] + b[4] * u[1] + b[5] * u[2]
                votes[part[some[j]], k] += more * more_there * abs(ha * hb)


@inlined
def _across(
    places: Points, normals: Points, T: Transform, u: Point
) -> tuple[Floats, Integers, float]:
    """Return surfaces across u, moved by T: place and normal (n, 6), which, what each stands for.

    T: (4, 4) to the frame of u.
    """
    which, count = np.empty(len(places), np.int64), 0
    for i in range(len(places)):
        along = 0.0
        for k in range(3):
            for c in range(3):
                along += u[k] * T[k, c] * normals[i, c]
        which[count] = i
        count += abs(along) > ACROSS
    which = which[: count : max(count // MOST, 1)]
    rows = np.empty((len(which), 6))
    for n in range(len(which)):
        for k in range(3):
            rows[n, k], rows[n, 3 + k] = T[k, 3], 0.0
            for c in range(3):
                rows[n, k] += T[k, c] * places[which[n], c]
                rows[n, 3 + k] += T[k, c] * normals[which[n], c]
    return rows, which, count / max(len(which), 1)
