"""How the rig moved, and what an error of that does to the places of its sensors."""

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from idem_ros.core import Cloud, register
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.undistortion import undistort

STILL = 0.02, 0.2  # [m/s], [deg/s]: of a rig that stands
ROUNDS = 3
# of the variance of two instants that see the same from two places: by rigs in streets and rooms
COMMON = 1.0 / 3.0
POINTS = 3000  # of a cloud, that are looked at
REACH = 3.0  # times how far points of a cloud are apart: what is nearer is seen by both
AROUND = 8  # points that tell how a surface lies


class Motion(NamedTuple):
    """How a rig moves at a time."""

    twist: NDArray[np.float64]
    """(6,) x y z [m/s] rx ry rz [rad/s] of the reference, in its own axes."""
    covariance: NDArray[np.float64]
    """(6, 6) of it."""


def step_between(first, second, config, guess=None):
    """Return the `RegistrationResult` of a sensor's later cloud to an earlier one; None: unknown.

    Args:
        first, second: `Cloud`s of one sensor.
        config: `RegistrationConfig`.
        guess: (4, 4); None: it stood.
    """
    result = register(first, second, guess, config)
    return result if result.is_usable else None


def motion_at_time(when, spread, measured, neighbours, config):
    """Return the `Motion` of a sensor; None: unknown.

    With two neighbours it may change evenly: in a bend each sweep is smeared differently, and one
    twist for all would be wrong by half of the change. By how much it changes within the spread of
    the times that it is to hold for is in the covariance, as is that of the steps.

    Args:
        when: [s] after the cloud's stamp.
        spread: [s] standard deviation of the times that it is to hold for.
        measured: `Measured`, the times after its own stamp, as of all of them.
        neighbours: one or two other clouds of the same sensor, each with how much later it is [s].
        config: `RegistrationConfig`.
    """
    track = sorted([(0.0, measured), *((late, each) for each, late in neighbours)], key=_stamp)
    stamps = np.array([stamp for stamp, _ in track])
    middles = stamps + [_middle(each) for _, each in track]
    rates, guesses, steps = np.zeros((len(track) - 1, 6)), [None] * (len(track) - 1), []
    for _ in range(ROUNDS):  # what the motion smears is undone by what was found of it before
        twists = _even_change(stamps, rates, middles)
        clouds = [
            at_one_time(each, np.eye(4), w) for (_, each), w in zip(track, twists, strict=True)
        ]
        steps = [
            step_between(*pair, config, guess)
            for *pair, guess in zip(clouds, clouds[1:], guesses, strict=False)
        ]
        if any(step is None for step in steps):
            nearer = neighbours[:1]
            return motion_at_time(when, spread, measured, nearer, config) if steps[1:] else None
        guesses = [step.T_target_source for step in steps]
        rates = np.array([se3.log(T)[se3.ROS_ORDER] for T in guesses]) / np.diff(stamps)[:, None]
    between = np.diff(stamps)[:, None, None]
    covariances = [step.assessment.covariance for step in steps] / between**2
    twist = _even_change(stamps, rates, np.array([when]))[0]
    later = _even_change(stamps, rates, np.array([when + spread]))[0] - twist
    # two steps share a cloud, and err alike
    return Motion(twist, covariances.mean(axis=0) + np.outer(later, later))


def _stamp(of_track):
    return of_track[0]


def _middle(measured):
    return 0.0 if measured.times is None else float(np.mean(measured.times))


def _even_change(stamps, rates, times):
    """Return the twists (K, 6) at times, given the mean rates (n, 6) between stamps."""
    between = (stamps[1:] + stamps[:-1]) / 2
    if len(rates) == 1:
        return np.repeat(rates, len(times), axis=0)
    change = (rates[1] - rates[0]) / (between[1] - between[0])
    return rates[0] + (np.asarray(times) - between[0])[:, None] * change


def is_still(twist):
    """Return whether a twist (6,) is that of a rig that stands."""
    speed, rate = np.linalg.norm(twist[:3]), np.degrees(np.linalg.norm(twist[3:]))
    return bool(speed <= STILL[0] and rate <= STILL[1])


def twist_at(pose, twist):
    """Return the twist of a sensor in its own axes: twist (6,) of the rig, pose (4, 4) in it."""
    return (se3.adjoint(se3.inverse(pose)) @ twist[se3.ROS_ORDER])[se3.ROS_ORDER]


def at_one_time(measured, pose, twist):
    """Return the `Cloud` that a sensor would have seen at time 0, had the rig stood there.

    Args:
        measured: `Measured`.
        pose: (4, 4) of the sensor in the frame of the reference, about.
        twist: (6,) of the reference, in its own axes.
    """
    points, times = measured
    if times is None or not twist.any():
        return Cloud(points)
    return Cloud(undistort(points, times, twist_at(pose, twist), 0.0))


def independent(steps, nearby):
    """Return how many instants that err each by itself would tell as much as these, from 1.

    What two of one place see is the same, and so are their errors. Of two places they have a third
    in common, as far as the clouds still overlap: the same surfaces, seen from elsewhere.

    Args:
        steps: `RegistrationResult` from each instant to the next; None where it is unknown, and
            nothing is taken to be in common.
        nearby: [m], of what moved less: it is one place.
    """
    count = len(steps) + 1
    common = np.eye(count)
    for i in range(count):
        still, overlap = True, 1.0
        for j, step in enumerate(steps[i:], start=i + 1):
            overlap *= 0.0 if step is None else step.overlap
            still &= step is not None and np.linalg.norm(step.T_target_source[:3, 3]) <= nearby
            common[i, j] = common[j, i] = 1.0 if still else COMMON * overlap
    return count**2 / common.sum()


class Seen(NamedTuple):
    """Some points of a sensor."""

    tree: KDTree
    """In the frame of the reference, about."""
    times: NDArray
    normals: NDArray
    reach: float
    """[m] within which a point of another sensor is of the same surface."""


def motion_covariances(measured, poses, covariance):
    """Return the covariance (S, 6, 6) of the sensors' poses by that of the motion.

    What two sensors both see they see at different times. Where the motion is wrong by a twist,
    clouds put to one time are off by it times that difference, and the poses take up what they
    can: the least squares of all points that two see, across their surfaces.

    Args:
        measured: `Measured` of each sensor, the reference's first; None: it was silent.
        poses: (S, 4, 4) in the frame of the reference.
        covariance: (6, 6) of the twist x y z rx ry rz of the reference, in its own axes.

    Returns:
        of x y z rx ry rz of each sensor, in the axes of the reference; zero of the reference.
    """
    found = np.zeros((len(measured), 6, 6))
    if not covariance.any():
        return found
    for s, (J, pose) in enumerate(zip(_moved_by(measured, poses), poses, strict=True)):
        about = np.eye(6)
        about[:3, 3:] = -se3.skew(pose[:3, 3])
        found[s] = about @ J @ covariance @ J.T @ about.T
    return found


def _moved_by(measured, poses):
    """Return (S, 6, 6): the twist that moves each sensor, by that of the motion in a second."""
    seen = {
        s: _seen(each, pose)
        for s, (each, pose) in enumerate(zip(measured, poses, strict=True))
        if each and len(each.points) > AROUND
    }
    count = len(measured)
    holds, pulls = np.zeros((count, 6, count, 6)), np.zeros((count, 6, 6))
    for i, j in itertools.combinations(seen, 2):
        rows, later = _shared(seen[i], seen[j])
        block, pull = rows.T @ rows, rows.T @ (later[:, None] * rows)
        holds[i, :, i] += block
        holds[j, :, j] += block
        holds[i, :, j] -= block
        holds[j, :, i] -= block
        pulls[j] -= pull
        pulls[i] += pull
    of_others = 6 * (count - 1)
    matrix = holds[1:, :, 1:].reshape(of_others, of_others)
    moved = np.linalg.lstsq(matrix, pulls[1:].reshape(of_others, 6), rcond=1e-9)[0]
    return np.concatenate([np.zeros((1, 6, 6)), moved.reshape(-1, 6, 6)])


def _seen(measured, pose):
    step = max(len(measured.points) // POINTS, 1)
    points = se3.transform_points(pose, measured.points[::step])
    times = np.zeros(len(points)) if measured.times is None else measured.times[::step]
    tree = KDTree(points)
    distances, near = tree.query(points, AROUND)
    around = points[near] - points[near].mean(axis=1, keepdims=True)
    normals = np.linalg.eigh(np.einsum('nki,nkj->nij', around, around))[1][:, :, 0]
    return Seen(tree, times, normals, REACH * float(np.median(distances[:, 1])))


def _shared(first, second):
    """Return n . [-[p]x, I]'s rows (N, 6) of points that both see, and how much later the second.

    A row times a twist x y z rx ry rz is how far that moves the point across its surface.
    """
    points = second.tree.data
    distances, nearest = first.tree.query(points, distance_upper_bound=first.reach)
    both = np.isfinite(distances)
    nearest, points = nearest[both], points[both]
    normals = first.normals[nearest]
    rows = np.hstack([normals, np.cross(points, normals)])
    return rows, second.times[both] - first.times[nearest]
