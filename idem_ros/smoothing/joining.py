"""Which keyframes are joined, and what workers do with them.

Joined are windows along the way; pairs that may close a loop are registered.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from idem_ros.core import Cloud, IdemError, PosePrior, RegistrationConfig, register, register_all
from idem_ros.core.geometry.se3 import inverse, rotation_angle
from idem_ros.smoothing.keyframes import KeyframeClouds

TOLD = 2  # keyframes after each that it is related to
APART = 3.0  # times the reach along the way, at least, between the two of a loop


def windows_of(count, size):
    """Return windows that cover `count` keyframes, each half over the one before.

    Returns:
        [(range of keyframes, pairs of places in it that it is to tell of)]: each keyframe with
        the `TOLD` after it, told once, by the window that has both nearest to its middle.
    """
    step = max(size // 2, 1)
    begins = [*range(0, max(count - size, 0), step), max(count - size, 0)]
    windows = [range(begin, min(begin + size, count)) for begin in begins]
    told = [[] for _ in windows]
    for i in range(count - 1):
        for j in range(i + 1, min(i + 1 + TOLD, count)):
            near = {*range(max((i - size) // step, 0), min(i // step + 1, len(windows) - 1))}
            having = [k for k in near | {len(windows) - 1} if i in windows[k] and j in windows[k]]
            if having:
                best = min(having, key=lambda k: abs(i + j - windows[k][0] - windows[k][-1]))
                told[best].append((i - windows[best][0], j - windows[best][0]))
    return list(zip(windows, map(tuple, told), strict=True))


def way_along(poses):
    """Return how far along the way each pose (K, 4, 4) is, (K,)."""
    steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    return np.r_[0.0, np.cumsum(steps)]


def loops_of(poses, reach, tried=()):
    """Return pairs (i, j), i < j, of keyframes that are near, and long after one another.

    Of each keyframe the nearest one of each earlier pass: a run of keyframes that are within
    reach of it.

    Args:
        poses: (K, 4, 4).
        reach: how far apart they may be.
        tried: pairs that are not asked for again.
    """
    positions, along = poses[:, :3, 3], way_along(poses)
    tree, known, found = KDTree(positions), set(tried), []
    for j, position in enumerate(positions):
        near = np.array(sorted(tree.query_ball_point(position, reach)), int)
        near = near[along[j] - along[near] > APART * reach]
        if not len(near):
            continue
        passes = np.split(near, np.flatnonzero(np.diff(along[near]) > APART * reach) + 1)
        for each in passes:
            i = int(each[np.argmin(np.linalg.norm(positions[each] - position, axis=1))])
            if (i, j) not in known:
                found.append((i, j))
    return found


@dataclass(frozen=True, slots=True)
class Relation:
    """What the clouds of two keyframes say of where they are to one another."""

    i: int
    j: int
    T_i_j: NDArray
    verdict: str
    """See `core.Verdict`."""
    overlap: float
    reason: str = ''
    covariance: NDArray | None = None
    """(6, 6), as of `core.PosePrior`; None: the verdict is that they cannot tell."""
    is_loop: bool = False

    @property
    def counts(self):
        """Whether it may decide about poses."""
        return self.covariance is not None

    @property
    def is_step(self):
        """Whether it is of a keyframe and the next."""
        return self.j == self.i + 1 and not self.is_loop


@dataclass(frozen=True)
class Joint:
    """Keyframes to be joined at once; small, for it is sent to workers."""

    path: str
    """What it is called where something is wrong with it."""
    folder: str
    numbers: tuple[int, ...]
    """Of the keyframes, in the order of time."""
    poses: NDArray
    """(K, 4, 4), by the trajectory."""
    sigmas: NDArray
    """(K - 1, 2): standard deviations of the trajectory's steps between them [m], [rad]."""
    told: tuple[tuple[int, int], ...]
    """Which two of them, by their place in the window, it is to tell a relation of."""
    config: RegistrationConfig


@dataclass(frozen=True)
class Pairs:
    """Pairs of keyframes to be registered."""

    path: str
    folder: str
    numbers: tuple[tuple[int, int], ...]
    guesses: NDArray
    """(P, 4, 4), the later in the earlier."""
    config: RegistrationConfig


@dataclass(frozen=True)
class Found:
    """What became of one of either."""

    path: str
    relations: tuple[Relation, ...] = ()
    reason: str = ''
    """Why there is nothing; empty: there is."""


def joined(task, progress=None):
    """Do a `Joint` or `Pairs`; return what was `Found`: what is wrong is in it, not raised."""
    try:
        clouds = KeyframeClouds(task.folder)
        return Found(task.path, _KINDS[type(task)](task, lambda k: Cloud(clouds.read(k))))
    except (IdemError, OSError) as error:
        return Found(task.path, reason=str(error))


def sigmas_of(poses, config, distance):
    """Return the deviations (K - 1, 2) [m], [rad] of the steps between poses (K, 4, 4).

    Args:
        poses: by the trajectory.
        config: `SmoothingConfig`.
        distance: [m] from one keyframe to the next: what a turn between two counts as.
    """
    steps = [inverse(a) @ b for a, b in zip(poses[:-1], poses[1:], strict=True)]
    moved = [np.linalg.norm(step[:3, 3]) for step in steps]
    turned = [np.degrees(rotation_angle(step)) / config.keyframe_turn for step in steps]
    way = np.maximum(np.array(moved) + distance * np.array(turned), 0.1 * distance)
    metres, degrees = config.odometry_sigma
    return way[:, None] * (metres, np.radians(degrees))


def priors_of(poses, sigmas):
    """Yield a `PosePrior` of each step between poses (K, 4, 4), of deviations (K - 1, 2)."""
    for k, sigma in enumerate(sigmas):
        yield PosePrior(
            source=k + 1,
            T=inverse(poses[k]) @ poses[k + 1],
            covariance=np.diag(np.repeat(np.square(sigma), 3)),
            target=k,
        )


def _window(task, read):
    """Return the `Relation`s of a window's keyframes, all registered at once.

    Each is judged, and has the covariance, of its two clouds alone, where the window puts them.
    """
    clouds = [read(number) for number in task.numbers]
    config = replace(task.config, assessment='none')
    priors = list(priors_of(task.poses, task.sigmas))
    poses = register_all(clouds, task.poses, config, held=(0,), priors=priors).poses
    audit = replace(task.config, assessment='verdict', mode='audit')
    return tuple(
        _relation(
            (task.numbers[i], task.numbers[j]),
            register(clouds[i], clouds[j], inverse(poses[i]) @ poses[j], audit),
        )
        for i, j in task.told
    )


def _pairs(task, read):
    """Return the `Relation`s of pairs, each registered alone."""
    config = replace(task.config, assessment='verdict')
    return tuple(
        _relation((i, j), register(read(i), read(j), guess, config), is_loop=True)
        for (i, j), guess in zip(task.numbers, task.guesses, strict=True)
    )


def _relation(pair, result, is_loop=False):
    said = result.assessment
    return Relation(
        *(*pair, result.T_target_source, said.verdict.value, result.overlap, said.reason),
        covariance=said.covariance if result.is_usable else None,
        is_loop=is_loop,
    )


_KINDS = {Joint: _window, Pairs: _pairs}
