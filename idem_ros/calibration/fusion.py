"""What several instants say of one sensor, as one: those that agree, weighed by what they promise.

The covariance is that of the weighed mean, made larger where the instants scatter more than
they promise, and not smaller than one instant's where they are all of one place. What the motion
of the rig adds is the same error at all of them, and is not divided. What bends a scan, a motion
or a sensor's own error, is in no covariance, and shows in that two clouds alone end elsewhere than
all at once: `contradiction`.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from idem_ros.calibration.frame_tree import UnknownStart, bare
from idem_ros.core import Verdict, register
from idem_ros.core.geometry import se3
from idem_ros.core.several.joint_result import USABLE, CloudVerdict
from idem_ros.core.trust.verdict import LEAST_PROBABILITY, NOTHING_KNOWN

TELLS = Verdict.ALIGNED, Verdict.DEGENERATE, Verdict.LOW_OVERLAP
LEAST_OVERLAP = 0.05
SAME_M, SAME_DEG = 0.5, 3.0  # what ends farther off is another valley
MEETS_LITTLE = Verdict.SEPARATED, Verdict.NOT_CONVERGED
APART = 'the clouds that it meets do not hang together with the reference'
SIGMAS = 3.0


def contradiction(clouds, result, config):
    """Return the factor, from 1, by which variances of an instant are to be multiplied.

    The squares of what pairs alone are off the poses, over their covariances, a degree of freedom
    of the loops that they close; 1 where they close none.

    Args:
        clouds: `Cloud`s.
        result: their `JointResult`.
        config: `RegistrationConfig` that finds what is near.
    """
    freedom, squares = -6 * (len(clouds) - 1), 0.0
    if len(result.edges) < len(clouds):
        return 1.0
    config = replace(config, voxel_size=result.voxel_size)
    for edge in result.edges:
        off = _off(clouds, result.poses, edge, config)
        if off is not None:
            freedom += 6
            squares += off
    return max(squares / freedom, 1.0) if freedom > 0 else 1.0


def _off(clouds, poses, edge, config):
    """Return the square of what two clouds alone are off, in covariances; None: they tell not."""
    if edge.overlap < LEAST_OVERLAP:
        return None
    T = se3.inverse(poses[edge.i]) @ poses[edge.j]
    alone = register(clouds[edge.i], clouds[edge.j], T, config)
    assert alone.assessment is not None, 'verdicts are asked for'
    if alone.assessment.verdict not in TELLS:
        return None
    off = difference(alone.T_target_source, T)
    distance, degrees = np.linalg.norm(off[:3]), np.degrees(np.linalg.norm(off[3:]))
    if distance > SAME_M or degrees > SAME_DEG:
        return None
    return float(off @ np.linalg.solve(alone.assessment.covariance, off))


class Drift(NamedTuple):
    """How far one sensor is from where it was."""

    name: str
    metres: float
    degrees: float
    sigmas: float
    """As improbable as so many standard deviations of one normal number."""

    @property
    def has_moved(self):
        """Whether it is farther off than chance has it."""
        return self.sigmas > SIGMAS

    def __str__(self):
        return f'{self.metres:.3g} m and {self.degrees:.2g} deg, {self.sigmas:.2g} sigma'


def drift_of(name, found, before, covariance):
    """Return the `Drift` of a sensor.

    Args:
        name: of the sensor.
        found: its `Fused`.
        before: (4, 4) where it was, in the frame of the same reference.
        covariance: (6, 6) of that, in the axes of the reference; zero where it is exact.
    """
    off = difference(found.pose, before)
    square = off @ np.linalg.solve(found.covariance + covariance, off)
    sigmas = stats.norm.isf(0.5 * stats.chi2.sf(square, 6))
    if np.isinf(sigmas):  # the probability is below the least number; it comes to the same
        sigmas = np.sqrt(square)
    distance, degrees = np.linalg.norm(off[:3]), np.degrees(np.linalg.norm(off[3:]))
    return Drift(name, float(distance), float(degrees), float(sigmas))


def covariances_of(tree, names):
    """Return (S, 6, 6) of sensors in the frame of the first by a `FrameTree`; zero where exact.

    Raises:
        UnknownStart: covariances are given in the frame of another sensor.
    """
    found = np.zeros((len(names), 6, 6))
    for s, name in enumerate(names):
        given = tree.covariances.get(bare(name))
        if s == 0 or given is None:
            continue
        if tree.parent_of(name) != bare(names[0]):
            raise UnknownStart(
                f'{tree.source} has {name} in the frame of {tree.parent_of(name)!r}, and '
                f'{names[0]!r} is the reference: take that of the file'
            )
        found[s] = given
    return found


class Fused(NamedTuple):
    """One sensor, by all instants."""

    pose: NDArray[np.float64]
    """(4, 4), in the frame of the reference."""
    covariance: NDArray[np.float64]
    """(6, 6) x y z rx ry rz, in the axes of the reference."""
    verdict: CloudVerdict
    agreeing: tuple[int, ...]
    """Instants that it is made of."""
    spread: tuple[float, float] | None
    """Root mean square of what these are off it, [m] and [deg]; None: there are not two."""
    by: str = 'clouds'
    """What tells of it: clouds that meet, or the motion of both sensors."""


def fused(solved, s, tolerance, independent):
    """Return the `Fused` of sensor `s`.

    Args:
        solved: `Solved` of every instant.
        s: number of the sensor; 0 is the reference, which stays.
        tolerance: [m], [deg]: what is nearer agrees, whatever is promised.
        independent: how many that err each by itself would tell as much, see `independent`.
    """
    told = [k for k, each in enumerate(solved) if _tells(each, s)]
    if not told:
        return _unknown(solved, s)
    share = min(independent, len(solved)) / len(solved)
    if s == 0:
        said = _verdict([solved[k].verdicts[0] for k in told], len(told), share)
        return Fused(np.eye(4), np.zeros((6, 6)), said, tuple(told), None)
    poses = np.array([solved[k].poses[s] for k in told])
    covariances = np.array([solved[k].covariances[s] for k in told])
    by_motion = np.array([_by_motion(solved[k].instant, s) for k in told])
    chosen = _agreeing(poses, covariances + by_motion, tolerance)
    agreeing = tuple(told[n] for n in chosen)
    pose, covariance = _mean(poses[chosen], covariances[chosen], by_motion[chosen], share)
    verdict = _verdict([solved[k].verdicts[s] for k in agreeing], len(told), share)
    off = np.array([difference(each, pose) for each in poses[chosen]])
    return Fused(pose, covariance, verdict, agreeing, _spread(off))


def difference(pose, other):
    """Return (6,) x y z rx ry rz of a pose from another, in the axes of their common frame."""
    turn = se3.log(pose @ se3.inverse(other))[:3]
    return np.r_[pose[:3, 3] - other[:3, 3], turn]


def _by_motion(instant, s):
    return np.zeros((6, 6)) if instant.by_motion is None else instant.by_motion[s]


def _tells(each, s):
    return each.meets[s] and each.verdicts[s].verdict not in MEETS_LITTLE


def _unknown(solved, s):
    each = next((each for each in solved if each.instant.clouds[s] is not None), solved[0])
    said = each.verdicts[s]
    if s and not each.meets[s] and said.verdict not in MEETS_LITTLE:  # of its own part alone
        said = CloudVerdict(Verdict.SEPARATED, 0.0, APART)
    covariance = NOTHING_KNOWN * np.eye(6) if s else np.zeros((6, 6))
    return Fused(each.poses[s], covariance, said, (), None)


def _agreeing(poses, covariances, tolerance):
    """Return the instants that agree with the one that most agree with."""
    count = len(poses)
    agree = np.ones((count, count), bool)
    off = np.zeros((count, count))
    for i in range(count):
        for j in range(i):
            step = difference(poses[i], poses[j])
            sigma = np.sqrt(step @ np.linalg.solve(covariances[i] + covariances[j], step) / 6)
            distance, degrees = np.linalg.norm(step[:3]), np.degrees(np.linalg.norm(step[3:]))
            near = max(distance / tolerance[0], degrees / tolerance[1])
            off[i, j] = off[j, i] = near
            agree[i, j] = agree[j, i] = near <= 1.0 or sigma <= SIGMAS
    middle = min(range(count), key=lambda i: (-agree[i].sum(), np.median(off[i])))
    return np.flatnonzero(agree[middle])


def _mean(poses, covariances, by_motion, share):
    """Return the weighed mean of poses (K, 4, 4), and its covariance; see `fused`."""
    information = np.linalg.inv(covariances + by_motion)
    total, mean = information.sum(axis=0), poses[0]
    for _ in range(3):
        off = np.array([difference(each, mean) for each in poses])
        moved = np.linalg.solve(total, np.einsum('kij,kj->i', information, off))
        mean = mean.copy()
        mean[:3, :3] = se3.exp(np.r_[moved[3:], np.zeros(3)])[:3, :3] @ mean[:3, :3]
        mean[:3, 3] += moved[:3]
    off = np.array([difference(each, mean) for each in poses])
    squares = np.einsum('ki,kij,kj->', off, information, off)
    freedom = 6 * (len(poses) - 1)
    more = max(squares / freedom, 1.0) if freedom else 1.0
    weights = np.linalg.solve(total, information)
    own = np.einsum('kij,kjl,kml->im', weights, covariances, weights)
    common = np.einsum('kij,kjl,kml->im', weights, by_motion, weights) * len(poses)
    return mean, more / max(share, 1.0 / len(poses)) * own + common


def _verdict(said, told, share):
    """Return the `CloudVerdict` of instants that agree.

    They are all wrong together or none: where their places are independent, the probabilities of
    being wrong are multiplied.

    Args:
        said: `CloudVerdict` of each.
        told: how many instants there are to agree.
        share: of them that are independent.
    """
    best = max(said, key=lambda each: (each.verdict in USABLE, np.nan_to_num(each.p_aligned)))
    if told == 1:
        return best
    if 2 * len(said) <= told:
        reason = f'only {len(said)} of {told} instants agree'
        return CloudVerdict(Verdict.MISALIGNED, best.p_aligned, reason)
    wrong = 1.0 - np.nan_to_num([each.p_aligned for each in said])
    p = float(1.0 - np.prod(wrong) ** max(share, 1.0 / len(said)))
    reason = f'{len(said)} of {told} instants agree; {best.reason}'
    if p < LEAST_PROBABILITY:
        return CloudVerdict(best.verdict, p, best.reason)
    return CloudVerdict(best.verdict if best.verdict in USABLE else Verdict.ALIGNED, p, reason)


def _spread(off):
    if len(off) < 2:
        return None
    squares = (off**2).reshape(-1, 2, 3).sum(axis=(0, 2)) / (len(off) - 1)
    return float(np.sqrt(squares[0])), float(np.degrees(np.sqrt(squares[1])))
