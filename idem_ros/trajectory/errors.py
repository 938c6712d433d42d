"""Errors of a trajectory by the field's definitions, as evo has them, and how smooth it is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from idem_ros.core.exceptions import IdemError
from idem_ros.files.trajectory_file import Trajectory

TOLERANCE = 0.01  # [s] between stamps that belong together
DELTA_TOLERANCE = 0.1  # of a distance: by how much a pair of `all_pairs` may miss it
STATISTICS = {
    'rmse': lambda errors: np.sqrt(np.mean(errors**2)),
    'mean': np.mean,
    'median': np.median,
    'std': np.std,
    'min': np.min,
    'max': np.max,
    'sse': lambda errors: np.sum(errors**2),
}


class IncomparableTrajectories(IdemError):
    """Two trajectories whose poses do not belong together, or cannot be aligned."""


@dataclass(frozen=True)
class Errors:
    """Errors of N poses or of N pairs of poses."""

    translation_m: NDArray
    """(N,), evo's "translation part"."""
    rotation_deg: NDArray
    """(N,), evo's "rotation angle in degrees"."""
    full: NDArray
    """(N,), evo's "full transformation": the Frobenius norm of the error's matrix less I."""

    def __len__(self):
        return len(self.full)


def associate(reference, estimate, tolerance=TOLERANCE):
    """Return the poses of two trajectories that belong together, as evo finds them.

    Each pose of the shorter one (of the estimate, if they are equally long) takes the nearest in
    time of the other, the earlier of two equally near, if it is within the tolerance. Poses
    without stamps belong together by their number.

    Args:
        reference, estimate: `Trajectory`.
        tolerance: [s].

    Returns:
        (reference, estimate): `Trajectory` of the same length.

    Raises:
        IncomparableTrajectories: no two stamps are that near, or one has no stamps and the
            lengths differ.
    """
    if reference.stamps is None or estimate.stamps is None:
        if len(reference) != len(estimate):
            raise IncomparableTrajectories(
                f'the reference has {len(reference)} poses and the estimate {len(estimate)}; '
                'without stamps in both (KITTI lines have none) they must have as many'
            )
        return reference, estimate
    short, long = (
        (reference, estimate) if len(estimate) > len(reference) else (estimate, reference)
    )
    after = np.searchsorted(long.stamps, short.stamps).clip(0, len(long) - 1)
    before = (after - 1).clip(0)
    distances = np.abs(long.stamps[[before, after]] - short.stamps)
    nearest = np.where(distances[0] <= distances[1], before, after)
    near = distances.min(axis=0) <= round(tolerance * 1e9)
    if not near.any():
        raise IncomparableTrajectories(
            f'no stamp of the estimate is within {tolerance:g} s of one of the reference; '
            f'they reach over {_span(estimate)} and {_span(reference)}'
        )
    short, long = _chosen(short, near), _chosen(long, nearest[near])
    return (short, long) if len(estimate) > len(reference) else (long, short)


def alignment(reference, estimate):
    """Return the (4, 4) rigid motion that brings the estimate's positions nearest (Umeyama).

    Args:
        reference, estimate: `Trajectory` of the same length.

    Raises:
        IncomparableTrajectories: the positions lie on one line, which leaves a rotation open.
    """
    x, y = estimate.poses[:, :3, 3], reference.poses[:, :3, 3]
    u, d, vt = np.linalg.svd((y - y.mean(axis=0)).T @ (x - x.mean(axis=0)))
    if len(x) < 3 or d[1] <= 1e-12 * d[0]:
        raise IncomparableTrajectories(
            f'the {len(x)} positions lie on one line, which leaves a rotation open; '
            'compare without alignment'
        )
    result = np.eye(4)
    result[:3, :3] = u @ np.diag([1, 1, np.linalg.det(u) * np.linalg.det(vt)]) @ vt
    result[:3, 3] = y.mean(axis=0) - result[:3, :3] @ x.mean(axis=0)
    return result


def ape(reference, estimate):
    """Return the absolute pose errors of two `Trajectory` of the same length: `Errors`."""
    return _errors(reference.poses, estimate.poses)


def rpe(reference, estimate, delta, unit, all_pairs=False):
    """Return the relative pose errors of the pairs a distance or a number of frames apart.

    Args:
        reference, estimate: `Trajectory` of the same length.
        delta: how far the poses of a pair are apart.
        unit: 'f': of frames; 'm': metres along the estimate's path.
        all_pairs: False: a pair begins where the one before ends, at the first pose that is at
            least `delta` away; True: one begins at each pose and ends at that nearest to
            `delta`, if it misses it by at most a tenth.

    Returns:
        `Errors` of the pairs; there may be none.
    """
    i, j = pairs_apart(estimate.poses[:, :3, 3], delta, unit, all_pairs)
    return _errors(
        relative(reference.poses[i], reference.poses[j]),
        relative(estimate.poses[i], estimate.poses[j]),
    )


def statistics(errors):
    """Return {name: number} of an array of errors by evo's names; None where there is none."""
    return {
        name: float(statistic(errors)) if len(errors) else None
        for name, statistic in STATISTICS.items()
    }


def pairs_apart(positions, delta, unit, all_pairs=False):
    """Return the indices (i, j) of the pairs that `rpe` compares; `positions` are (N, 3)."""
    if unit == 'f':
        count = len(positions)
        if all_pairs:
            i = np.arange(max(0, count - delta))
            return i, i + delta
        ids = np.arange(0, count, delta)
        return ids[:-1], ids[1:]
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    return _all_pairs(steps, delta) if all_pairs else _consecutive_pairs(steps, delta)


def path_length(trajectory):
    """Return the distances [m] along the path from its first pose, (N,)."""
    steps = np.linalg.norm(np.diff(trajectory.poses[:, :3, 3], axis=0), axis=1)
    return np.r_[0, np.cumsum(steps)]


def relative(start, end):
    """Return the (N, 4, 4) poses of `end` in the frames of `start`."""
    result = np.zeros_like(end)
    rotation_t = start[:, :3, :3].transpose(0, 2, 1)
    result[:, :3, :3] = rotation_t @ end[:, :3, :3]
    result[:, :3, 3] = np.einsum('nij,nj->ni', rotation_t, end[:, :3, 3] - start[:, :3, 3])
    result[:, 3, 3] = 1
    return result


def _errors(truth, found):
    if not len(truth):  # scipy refuses an empty stack of rotations
        return Errors(*np.empty((3, 0)))
    difference = relative(truth, found)
    return Errors(
        np.linalg.norm(difference[:, :3, 3], axis=1),
        np.degrees(Rotation.from_matrix(difference[:, :3, :3]).magnitude()),
        np.linalg.norm(difference - np.eye(4), axis=(1, 2)),
    )


def _consecutive_pairs(steps, delta):
    ids, path = [0], 0.0
    # summed anew from each end of a pair, as evo does: other rounding would end others elsewhere
    for i, step in enumerate(steps.tolist(), start=1):
        path += step
        if path >= delta:
            ids.append(i)
            path = 0.0
    return np.array(ids[:-1], dtype=int), np.array(ids[1:], dtype=int)


def _all_pairs(steps, delta):
    path = np.r_[0, np.cumsum(steps)]
    pairs = []
    for i in range(len(path) - 1):
        misses = np.abs(path[i + 1 :] - path[i] - delta)
        nearest = int(np.argmin(misses))
        if misses[nearest] <= delta * DELTA_TOLERANCE:
            pairs.append((i, i + 1 + nearest))
    i, j = np.array(pairs, dtype=int).reshape(-1, 2).T
    return i, j


def _chosen(trajectory, which):
    return Trajectory(trajectory.poses[which], trajectory.stamps[which])


def _span(trajectory):
    first, last = trajectory.stamps[[0, -1]] / 1e9
    return f'{first:.3f} .. {last:.3f} s'


def second_differences(stamps, poses):
    """Return how far each pose is from where its neighbours in time would have it, twice.

    Where stamps are evenly spaced, that of the positions is |p(i+1) - 2 p(i) + p(i-1)|; where
    they are not, the neighbours are interpolated at the stamp, so that a missing frame is no
    jump.

    Args:
        stamps: (N,) [ns].
        poses: (N, 4, 4) of one body in one frame.

    Returns:
        (positions, rotations): (N,) in the unit of the poses and (N,) [deg]; NaN for the first
        and the last, which have one neighbour.
    """
    positions, rotations = np.full((2, len(poses)), np.nan)
    if len(poses) < 3:
        return positions, rotations
    share = _shares(np.asarray(stamps, dtype=np.int64))
    p = poses[:, :3, 3]
    between = p[:-2] + share[:, None] * (p[2:] - p[:-2])
    positions[1:-1] = 2 * np.linalg.norm(p[1:-1] - between, axis=1)
    R = poses[:, :3, :3]
    before, here, after = (Rotation.from_matrix(each) for each in (R[:-2], R[1:-1], R[2:]))
    turn = (before.inv() * after).as_rotvec()
    between = before * Rotation.from_rotvec(share[:, None] * turn)
    rotations[1:-1] = np.degrees(2 * (between.inv() * here).magnitude())
    return positions, rotations


def _shares(stamps):
    """Return when each inner stamp comes, from 0 at the one before to 1 at the one after."""
    before, here, after = stamps[:-2], stamps[1:-1], stamps[2:]
    ordered = (before < here) & (here < after)  # not where a recording was played in a loop
    span = np.where(ordered, after - before, 2)
    return np.where(ordered, here - before, 1) / span
