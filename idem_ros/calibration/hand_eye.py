"""Where a sensor is on a rig, by how both moved: what moves together is mounted together.

A step A of the reference and B of the sensor, between the same two times, and the sensor's pose X
in the frame of the reference: A X = X B. Turns about two axes tell all of X; about one axis alone
they leave open where it is along that axis, and without turns all of where it is. What the steps
leave open stays as it started, with the variance that a start may have.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from idem_ros.calibration.fusion import SIGMAS, Fused
from idem_ros.calibration.relative_motions import steps_of
from idem_ros.core import Verdict
from idem_ros.core.geometry import se3
from idem_ros.core.several.joint_result import USABLE, CloudVerdict
from idem_ros.core.trust.reasons import named

START = np.repeat([0.5, np.radians(45.0)], 3)  # standard deviation of where it is looked for
MEDIAN = 5.348  # of the squares of six normal numbers
ROUNDS = 3
OPEN = 1  # directions that may be: more are no place


def with_motion(found, names, strides, config):
    """Return a `Calibration` whose sensors that clouds do not tell of are placed by motion.

    Args:
        found: `Calibration` by clouds.
        names: of the sensors.
        strides: `Stride`s.
        config: `RegistrationConfig` that the rig was calibrated with.

    Returns:
        the `Calibration`, and a line about each sensor that it places so.
    """
    config = replace(config, voxel_size=found.voxel_size)
    rows, spans = [], []
    for stride in strides:  # their clouds are many: one at a time
        rows.append(steps_of(stride, config))
        spans.append((stride.at, stride.at + stride.seconds))
    sensors, notes = list(found.sensors), []
    for s, (name, is_usable) in enumerate(zip(names, found.usable, strict=True)):
        pairs = [(row[0], row[s]) for row in rows if row[0] is not None and row[s] is not None]
        if s == 0 or is_usable or not pairs:
            continue
        placed = hand_eye(pairs, found.starts[s], config.audit_tolerance, _share(spans))
        if placed.verdict.verdict in USABLE:
            notes.append(f'{name} is placed by its motion: {placed.verdict.reason}')
        else:
            both = f'{sensors[s].verdict.reason}; by its motion: {placed.verdict.reason}'
            placed = placed._replace(verdict=replace(placed.verdict, reason=both))
        sensors[s] = placed
    if notes and not found.usable[0]:
        p = max(each.verdict.p_aligned for each in sensors[1:])
        said = CloudVerdict(Verdict.ALIGNED, p, 'others are placed by its motion')
        sensors[0] = sensors[0]._replace(verdict=said)
    return replace(found, sensors=tuple(sensors)), notes


def _share(spans):
    """Return which share of [(begin, end)] no other one covers: what lies in two errs in both."""
    covered, latest = 0.0, -np.inf
    for begin, end in sorted(spans):
        covered += max(end - max(begin, latest), 0.0)
        latest = max(latest, end)
    total = sum(end - begin for begin, end in spans)
    return covered / total if total > 0.0 else 1.0


def hand_eye(pairs, start, tolerance, share=1.0):
    """Return the `Fused` of a sensor by its steps and those of the reference.

    Args:
        pairs: [(`Step` of the reference, `Step` of the sensor)], one at least.
        start: (4, 4) in the frame of the reference, up to 45 deg and 0.5 m off.
        tolerance: [m], [deg]: what the steps tell no better is open.
        share: of the steps, that err each by itself.
    """
    steps, X = _Steps(pairs), np.array(start, dtype=np.float64)
    for _ in range(ROUNDS):  # the steps' weights are by where the sensor is
        X, _ = _nearest(steps, X, start, 'soft_l1')
    squares = steps.squares(X)
    agree = squares <= 6 * SIGMAS**2 * max(np.median(squares) / MEDIAN, 1.0)
    steps = steps.some(agree)
    X, information = _nearest(steps, X, start, 'linear')
    freedom = 6 * (len(steps) - 1)
    more = max(steps.squares(X).sum() / freedom, 1.0) if freedom else 1.0
    covariance = np.linalg.inv(share / more * information + np.diag(1.0 / START**2))
    agreeing = tuple(np.flatnonzero(agree).tolist())
    said = _verdict([pairs[k] for k in agreeing], len(pairs), share)
    verdict = _with_open(said, covariance, tolerance)
    return Fused(X, covariance, verdict, agreeing, None, 'motion')


class _Steps:
    """Steps in rows."""

    def __init__(self, pairs):
        self._pairs = pairs
        A, self._B = (np.array([pair[k].T for pair in pairs]) for k in (0, 1))
        self._of_A, self._of_B = (np.array([pair[k].covariance for pair in pairs]) for k in (0, 1))
        self._A = _above_noise(A, self._of_A.mean(axis=0))

    def __len__(self):
        return len(self._pairs)

    def some(self, chosen):
        """Return those that are chosen, (K,)."""
        return _Steps([pair for pair, each in zip(self._pairs, chosen, strict=True) if each])

    def off(self, X):
        """Return what each sensor's step is off that of the reference, (K, 6) x y z rx ry rz."""
        told = se3.inverse(X) @ self._A @ X
        turned = told[:, :3, :3] @ np.swapaxes(self._B[:, :3, :3], 1, 2)
        return np.hstack(
            [told[:, :3, 3] - self._B[:, :3, 3], Rotation.from_matrix(turned).as_rotvec()]
        )

    def roots(self, X):
        """Return (K, 6, 6) that make of `off` numbers of variance 1."""
        R, arms = X[:3, :3].T, self._A[:, :3, :3] @ X[:3, 3]
        of_A = np.zeros((len(arms), 6, 6))
        of_A[:, :3, :3] = of_A[:, 3:, 3:] = R
        of_A[:, :3, 3:] = [-R @ se3.skew(arm) for arm in arms]
        covariances = self._of_B + of_A @ self._of_A @ np.swapaxes(of_A, 1, 2)
        return np.linalg.inv(np.linalg.cholesky(covariances))

    def squares(self, X):
        """Return the squared distances (K,), in the steps' own deviations."""
        return (np.einsum('kij,kj->ki', self.roots(X), self.off(X)) ** 2).sum(axis=1)


def _above_noise(T, covariance):
    """Return steps (K, 4, 4) without what of their turns and ways may be noise.

    Noise is like a turn about an axis, and would tell of the sensor. Of each direction that share
    of all steps is kept by which they are more than chance makes of the covariance (6, 6).
    """
    ways, turns = T[:, :3, 3], Rotation.from_matrix(T[:, :3, :3]).as_rotvec()
    kept = T.copy()
    kept[:, :3, 3] = ways @ _kept(ways, covariance[:3, :3]).T
    turns = turns @ _kept(turns, covariance[3:, 3:]).T
    kept[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    return kept


def _kept(vectors, noise):
    """Return the (3, 3) matrix that takes from vectors (K, 3) what may be noise (3, 3)."""
    root = np.linalg.cholesky(noise)
    white = np.linalg.solve(root, vectors.T)
    squares, axes = np.linalg.eigh(white @ white.T / len(vectors))
    chance = (1.0 + np.sqrt(3.0 / len(vectors))) ** 2  # the greatest of noise alone
    share = np.maximum(1.0 - chance / np.maximum(squares, chance), 0.0)
    return root @ (axes * share) @ axes.T @ np.linalg.inv(root)


def _nearest(steps, X, start, loss):
    """Return the pose that steps and start agree on best, and the steps' information (6, 6)."""
    roots = steps.roots(X)

    def residuals(move):
        """Return what steps, and the start, are off a pose, in their own deviations."""
        at = _moved(X, move)
        there = np.r_[at[:3, 3] - start[:3, 3], _turn(at @ se3.inverse(start))]
        return np.r_[np.einsum('kij,kj->ki', roots, steps.off(at)).ravel(), there / START]

    found = least_squares(residuals, np.zeros(6), loss=loss, f_scale=SIGMAS)
    J = found.jac[:-6]
    return _moved(X, found.x), J.T @ J


def _moved(X, move):
    """Return a pose moved by x y z rx ry rz, in the axes of the reference, about the sensor."""
    moved = np.eye(4)
    moved[:3, :3] = se3.exp(np.r_[move[3:], np.zeros(3)])[:3, :3] @ X[:3, :3]
    moved[:3, 3] = X[:3, 3] + move[:3]
    return moved


def _turn(T):
    return Rotation.from_matrix(T[:3, :3]).as_rotvec()


def _verdict(agreeing, told, share):
    """Return the `CloudVerdict` of pairs of steps that agree, of so many."""
    right = [np.nan_to_num([step.verdict.p_aligned for step in pair]).min() for pair in agreeing]
    p = float(1.0 - np.prod(1.0 - np.array(right)) ** share)
    reason = f'{len(right)} of {told} steps agree'
    if 2 * len(right) <= told:
        return CloudVerdict(Verdict.MISALIGNED, p, f'only {reason}')
    return CloudVerdict(Verdict.ALIGNED, p, reason)


def _with_open(said, covariance, tolerance):
    """Return a `CloudVerdict` that names the motions of the sensor that the steps leave open."""
    metres, degrees = tolerance
    units = np.repeat([metres, np.radians(degrees)], 3)
    variances, axes = np.linalg.eigh(covariance / np.outer(units, units))
    axes = axes[:, variances > 1.0]
    if said.verdict is Verdict.MISALIGNED or not axes.size:
        return said
    is_turn = np.linalg.norm(axes[3:], axis=0) > np.linalg.norm(axes[:3], axis=0)
    words = [
        f'{how} {named(vectors[:, chosen])} by {_most(block, vectors[:, chosen], unit):.2g} {what}'
        for how, vectors, chosen, block, unit, what in (
            ('along', axes[:3], ~is_turn, covariance[:3, :3], 1.0, 'm'),
            ('about', axes[3:], is_turn, covariance[3:, 3:], np.degrees(1.0), 'deg'),
        )
        if chosen.any()
    ]
    left = f'the drive leaves open where it is {" and ".join(words)} (1 sigma)'
    verdict = Verdict.DEGENERATE if axes.shape[1] <= OPEN else Verdict.NOT_CONVERGED
    return CloudVerdict(verdict, said.p_aligned, f'{said.reason}; {left}')


def _most(covariance, vectors, unit):
    along = vectors / np.linalg.norm(vectors, axis=0)
    return unit * float(np.sqrt((along * (covariance @ along)).sum(axis=0).max()))
