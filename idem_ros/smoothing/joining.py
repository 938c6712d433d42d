"""What workers do: keyframes of a window joined, and pairs that may close a loop registered."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from idem_ros.core import Cloud, IdemError, PosePrior, RegistrationConfig, register, register_all
from idem_ros.core.geometry.se3 import inverse, rotation_angle
from idem_ros.smoothing.keyframes import KeyframeClouds


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
