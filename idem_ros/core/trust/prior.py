"""A guess that says how far it may be off, or a twist, is weighed against what the clouds say.

The result is that of maximum a posteriori, both errors taken to be normal: what the clouds hold
firmly is theirs, what they hold weakly lies between, what they leave free stays as guessed. A
twist is of constant velocity, by the sweep before, or of an odometry; what the result tells of it
tells of the pose, too, by how the two errors go together.
"""

from dataclasses import replace
from math import exp
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Floats, Matrix6, Point, Transform
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.geometry import se3
from idem_ros.core.trust.pose_twist import to_pose
from idem_ros.core.trust.verdict import Assessment, Verdict

# Squared Mahalanobis distance of six numbers, which one right guess in 25 000 exceeds: such a one
# is not as near as it says, as a constant covariance of odometry often is not.
FARTHEST_SQUARED = 30.0
SYMMETRIC = 1e-6  # of the largest variance
ORDER = 'x y z rx ry rz'


class Guess(NamedTuple):
    """Where a solve starts from, and how much is known of that."""

    transform: Transform
    information: Matrix6  # of the pose, x y z rx ry rz; zeros: nothing


class Weighed(NamedTuple):
    """A result that a guess has been weighed into."""

    transform: Transform
    covariance: Matrix6  # of the pose, x y z rx ry rz
    distance: float  # from the result to the guess, in the deviations of both
    is_believed: bool  # whether the guess may be as near as it says; else it is not weighed


def information_of_guess(covariance: ArrayLike | None, config: RegistrationConfig) -> Matrix6:
    """Return the (6, 6) information of a guess, x y z rx ry rz; zeros where it says nothing.

    Args:
        covariance: (6, 6) of the source frame's pose in the target frame; a variance of 0 says
            nothing of that axis, as in messages. None: `config.guess_sigma`.
        config: `RegistrationConfig`.

    Raises:
        InvalidConfig: the covariance is none, or could not be weighed.
    """
    length, degrees = config.guess_sigma
    given = np.diag(np.repeat([length, np.radians(degrees)], 3) ** 2)
    if covariance is not None:
        given = _checked(covariance)
    some = np.flatnonzero(given.diagonal())
    information = np.zeros((6, 6))
    information[np.ix_(some, some)] = np.linalg.inv(given[np.ix_(some, some)])
    return information


def _checked(covariance: ArrayLike) -> Matrix6:
    name = 'the covariance of the guess'
    try:
        given = np.array(covariance, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidConfig(f'{name} is {covariance!r}; it must be (6, 6) numbers') from error
    if given.shape != (6, 6):
        raise InvalidConfig(f'{name} has shape {given.shape}; it must be (6, 6), {ORDER}')
    if not np.isfinite(given).all():
        raise InvalidConfig(f'{name} is not finite; zeros say that it is not known')
    if (given.diagonal() < 0.0).any():
        raise InvalidConfig(
            f'{name} has the variances {given.diagonal()}, {ORDER}; none may be below 0, zeros '
            'say that it is not known'
        )
    some = np.flatnonzero(given.diagonal())
    of_some = given[np.ix_(some, some)]
    scale = np.sqrt(of_some.diagonal())
    of_some = of_some / np.outer(scale, scale)
    is_symmetric = np.abs(of_some - of_some.T).max(initial=0.0) <= SYMMETRIC
    if not is_symmetric or (np.linalg.eigvalsh(of_some) <= 0.0).any():
        raise InvalidConfig(
            f'{name} is not symmetric and positive definite; zeros say that it is not known'
        )
    return (given + given.T) / 2


def weighed(
    T: Transform, covariance: Matrix6, T_guess: Transform, information: Matrix6, position: Point
) -> Weighed:
    """Return a result `Weighed` against its guess.

    Args:
        T: (4, 4) the result, between the clouds' origins.
        covariance: (6, 6) of its pose, x y z rx ry rz.
        T_guess: (4, 4) likewise.
        information: (6, 6) of the guess's pose.
        position: (3,) of the source frame's origin in the target frame, at the result.
    """
    moved = to_pose(position)
    off = moved @ se3.log(T_guess @ se3.inverse(T))
    both = np.linalg.inv(covariance) + information
    posterior = np.asarray(np.linalg.inv(both), np.float64)
    shift: Floats = posterior @ information @ off
    squared = float(off @ information @ (off - shift))  # off^T (both covariances)^-1 off
    if squared > FARTHEST_SQUARED:
        return Weighed(T, covariance, float(np.sqrt(squared)), is_believed=False)
    T_weighed = se3.exp(np.asarray(np.linalg.solve(moved, shift), np.float64)) @ T
    return Weighed(T_weighed, posterior, float(np.sqrt(max(squared, 0.0))), is_believed=True)


def beyond_guess(assessment: Assessment, distance: float) -> Assessment:
    """Return what is said of a result that is farther from its guess than that allows.

    A covariance of guesses is often too small; a basin is not: where the result lies beyond it
    both speak against it.

    distance: in the deviations of both.
    """
    far = f'it is {distance:.2g} deviations from the guess'
    if assessment.way <= 1.0:
        return replace(assessment, reason=f'{assessment.reason}; {far}, which is not weighed')
    p = assessment.p_aligned * exp((FARTHEST_SQUARED - distance**2) / 2.0)
    return replace(assessment, verdict=Verdict.MISALIGNED, p_aligned=p, reason=far)


class WeighedTwist(NamedTuple):
    """A result that a twist has been weighed into."""

    transform: Transform
    twist: Floats  # (6,) x y z rx ry rz a second
    covariance: Floats  # (12, 12) of the pose and of the twist
    distance: float  # from what was found to what was known, in the deviations of both
    is_believed: bool  # whether what was known may be as near as it says; else it is not weighed


def weighed_twist(
    T: Transform,
    twist: Floats,
    covariance: Floats,
    given: Floats,
    sigma: tuple[float, ...],
    position: Floats,
) -> WeighedTwist:
    """Return a result weighed against the twist that was given.

    Args:
        T: (4, 4) its pose, between the clouds' origins.
        twist: (6,) that was found, x y z rx ry rz a second.
        covariance: (12, 12) of the pose, x y z rx ry rz, and of the twist.
        given: (6,) the twist that was known.
        sigma: its standard deviations, a length and an angle [deg] a second; 0: nothing is known.
        position: (3,) of the source frame's origin in the target frame, at the pose.
    """
    length, degrees = sigma
    deviations = np.repeat([length, np.radians(degrees)], 3)
    some = 6 + np.flatnonzero(deviations)
    off = (given - twist)[some - 6]
    of_both = covariance[np.ix_(some, some)] + np.diag(deviations[some - 6] ** 2)
    gain: Floats = np.asarray(np.linalg.solve(of_both, covariance[some]), np.float64).T
    squared = float(off @ np.linalg.solve(of_both, off))
    if squared > FARTHEST_SQUARED:
        return WeighedTwist(T, twist, covariance, float(np.sqrt(squared)), is_believed=False)
    shift: Floats = gain @ off
    of_pose = np.asarray(np.linalg.solve(to_pose(position), shift[:6]), np.float64)
    rest = covariance - gain @ covariance[some]
    T = se3.exp(of_pose) @ T
    return WeighedTwist(T, twist + shift[6:], rest, float(np.sqrt(squared)), is_believed=True)
