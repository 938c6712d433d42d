"""How much worse the clouds agree a radius away from a pose, along each observable motion."""

from collections.abc import Sequence

import numpy as np

from idem_ros.core.arrays import Floats, Indices, Integers, Transform, Transforms, Twists
from idem_ros.core.geometry import se3
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.entropy import sums_of_each
from idem_ros.core.trust.constraining_surfaces import Holders

SAMPLE = 128  # centres of each cloud, about


def mean_contrast(balls: Balls, T_target_source: Transform, motions: Twists, sample: int) -> float:
    """Return by how much q_mean is higher a radius to either side of a pose, on average.

    Of a sample of the points that have a neighbour in the other cloud at the pose; 0 where none.

    Args:
        balls: `Balls` of the clouds.
        T_target_source: (4, 4) pose, between the clouds' origins.
        motions: (6, k) twists (omega, v) that move the surfaces by about 1.
        sample: how many of each cloud, about.
    """
    chosen = [_sampled(some, sample) for some in balls.near(T_target_source)]
    around = _around(T_target_source, balls.radius * motions)
    places = np.concatenate([T_target_source[None], around])
    q, within = _sums_in_reach(balls, places, chosen)
    return float((q[1:] - q[0]).mean() / within[0]) if within[0] else 0.0


def contrasts_along(
    balls: Balls, T_target_source: Transform, holders: Holders, q: tuple[Floats, Floats]
) -> Floats:
    """Return the lesser rise of q_mean a radius to either side, (k,), of what holds each motion.

    Args:
        balls: `Balls` of the clouds.
        T_target_source: (4, 4) pose, between the clouds' origins.
        holders: the `Holders` of k motions, which have a neighbour in the other cloud.
        q: (N,) q_i of the target's points at the pose, and (M,) of the source's.
    """
    k = holders.motions.shape[1]
    places = _around(T_target_source, balls.radius * holders.motions)
    of_two = [2 * each for each in holders.motion]
    found = balls.differences(places, holders.centres, of_two)
    rises = [
        there - of_all[cloud.order[centres], None]
        for of_all, cloud, centres, (there, _) in zip(
            q, balls.clouds, holders.centres, found, strict=True
        )
    ]
    forth, back = np.concatenate(rises).T
    motion = np.concatenate(holders.motion)
    least = np.minimum(np.bincount(motion, forth, k), np.bincount(motion, back, k))
    return least / np.maximum(np.bincount(motion, minlength=k), 1.0)


def sums_at_each(
    balls: Balls, transforms: Transforms, sample: int = SAMPLE
) -> tuple[Floats, Integers]:
    """Return the sum of q_i (K,) at transforms (K, 4, 4), and of how many points each is (K,).

    Of a sample of the points in reach at the first; one out of reach at another counts 0 there.
    """
    chosen = [_sampled(some, sample) for some in balls.near(transforms[0])]
    return _sums_in_reach(balls, transforms, chosen)


def _sums_in_reach(
    balls: Balls, transforms: Transforms, chosen: Sequence[Indices]
) -> tuple[Floats, Integers]:
    (q, within), (q_source, within_source) = (
        sums_of_each(q, reach, reach[:, 0] > 0.0)
        for q, reach in balls.differences(transforms, chosen)
    )
    return q + q_source, within + within_source


def _around(T: Transform, motions: Twists) -> Transforms:
    """Return (2 k, 4, 4): the poses after each of (6, k) motions, forth and back."""
    ways = np.stack([motions.T, -motions.T], axis=1).reshape(-1, 6)
    return se3.exps(ways) @ T


def _sampled(some: Indices, sample: int) -> Indices:
    return some[:: max(round(len(some) / sample), 1)]
