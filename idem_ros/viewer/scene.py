"""What a page shows of one registration: points, poses, curves of q_tot, and numbers."""

import json
from base64 import b64encode
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.transform import Rotation

from idem_ros.core import Cloud, Landscape, register
from idem_ros.core.config import AUTO
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.core.metric.landscape import AXES, centroid, displaced
from idem_ros.core.metric.measured_points import usual
from idem_ros.core.metric.region_of_interest import nearest_maximum
from idem_ros.refinement.debug_clouds import points_of, points_with_q, within_reach
from idem_ros.refinement.diagnostics import assessment_values

GUESS, REFINED = 'at the guess', 'refined'
AROUND = 0.2  # sizes of the source that the target is shown beyond it
SEED = 0
MOST_POINTS = 100_000  # of each cloud
SAME = 0.1  # radii within which two results are one
STEPS = 40  # of a curve, on either side of the result
REACH = 4.0  # radii that a curve goes at least


@dataclass(frozen=True)
class CloudsView:
    """Points are in random order, so that the first of them are an even sample."""

    target: np.ndarray
    """(N, 3) float32, in the target frame, moved to the middle of the source."""
    source: np.ndarray
    """(M, 3) float32, in the source frame."""
    of: tuple[int, int]
    """How many points of the target (of it what is around the source) and the source there are."""
    poses: tuple[np.ndarray, ...]
    """(4, 4) source in the moved target frame: at the guess, after each step, and refined."""
    means: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    """(K, 3): some of what q_tot is of, both clouds at the result, in the moved target frame."""
    q: np.ndarray = field(default_factory=lambda: np.empty(0))
    """(K,): what each adds to q_tot [nat]."""
    free: np.ndarray = field(default_factory=lambda: np.empty((0, 6)))
    """(F, 6): motions that nothing determines, x y z rx ry rz in the target frame."""

    @property
    def names(self):
        """Return what to call each of the poses."""
        return [GUESS, *(f'step {k}' for k in range(1, len(self.poses) - 1)), REFINED]

    @property
    def extent(self):
        """Return how wide the source is, without its farthest points."""
        spread = np.abs(transform_points(self.poses[-1], self.source))
        return 2.0 * float(np.percentile(spread, 95)) or 1.0

    def as_json(self):
        """Return what the script draws: points in base64, poses by columns."""
        arrays = {name: getattr(self, name) for name in ('target', 'source', 'means', 'q')}
        record = {
            **{name: _encoded(values) for name, values in arrays.items()},
            'of': self.of,
            'poses': [pose.T.ravel().tolist() for pose in self.poses],
            'names': self.names,
            'free': self.free.tolist(),
            'extent': self.extent,
        }
        return json.dumps(record).replace('<', '\\u003c')


def view_of(target, source, poses, most, found=None, free=()):
    """Return the `CloudsView` of two clouds.

    Args:
        target, source: (N, 3) points.
        poses: (4, 4) source in target frame, from the guess to the result.
        most: points of each that are shown.
        found: (means (K, 3), q (K,)) in the target frame, see `CloudsView`; None: unknown.
        free: (F, 6), see `CloudsView`.
    """
    middle = np.median(transform_points(poses[-1], source), axis=0)
    to_middle = np.eye(4)
    to_middle[:3, 3] = -middle
    near = _around(target, source, poses)
    means, q = np.split(_sample(np.c_[found] if found else np.empty((0, 4)), 2 * most), [3], 1)
    return CloudsView(
        target=np.asarray(_sample(near, most) - middle, np.float32),
        source=np.asarray(_sample(source, most), np.float32),
        of=(len(near), len(source)),
        poses=tuple(to_middle @ pose for pose in poses),
        means=np.asarray(means - middle, np.float32),
        q=np.asarray(q[:, 0], np.float32),
        free=np.reshape(free, (-1, 6)),
    )


def _around(target, source, poses):
    """Leave out of the target what is far off the source: a map may be large."""
    ends = np.concatenate([transform_points(poses[k], source) for k in (0, -1)])
    low, high = ends.min(axis=0), ends.max(axis=0)
    margin = AROUND * (high - low).max()
    inside = ((target >= low - margin) & (target <= high + margin)).all(axis=1)
    return target[inside] if inside.any() else target


def _sample(points, most):
    return np.random.default_rng(SEED).permutation(points)[:most]


def _encoded(values):
    return b64encode(np.ascontiguousarray(values, dtype='<f4').tobytes()).decode()


@dataclass(frozen=True)
class Curve:
    """q_tot where the source is moved along, or turned about, one axis of the target frame."""

    axis: str
    offsets: np.ndarray
    """(S,) [m], or [deg] about an axis; 0 at the result."""
    q_tot: np.ndarray
    """(S,) [nat]"""
    guess: float
    """Where the guess was, as its offset along this axis."""
    crests: tuple[float, ...]
    """Offsets of the nearest maxima, below and above, where there are any."""


@dataclass(frozen=True)
class Scene:
    """What is shown of one registration."""

    title: str
    view: CloudsView
    curves: tuple[Curve, ...]
    values: dict[str, str]
    """What the verdict stands on, by name."""

    @property
    def headline(self):
        """The verdict with its reason, or the status."""
        reason = self.values.get('verdict_reason') or self.values['status']
        return f'{self.values.get("verdict", "")}: {reason}'.removeprefix(': ')


def scene_of(title, target, source, T_guess, config, T_found=None):
    """Register two clouds again, and return the `Scene` of it.

    Args:
        title: of the page.
        target, source, T_guess, config, T_found: see `seen_again`.
    """
    view, result = seen_again(target, source, T_guess, config, MOST_POINTS, T_found)
    return Scene(
        title=title,
        view=view,
        curves=tuple(_curves((Cloud(target), Cloud(source)), T_guess, result, config)),
        values={name: str(value) for name, value in _values(result).items()},
    )


def seen_again(target, source, T_guess, config, most, T_found=None):
    """Register two clouds again, and return the `CloudsView` of each step, and the result.

    Args:
        target, source: (N, 3) points that took part.
        T_guess: (4, 4) where the registration started.
        config: `RegistrationConfig`.
        most: points of each cloud that are shown.
        T_found: (4, 4) where it ended then; None: unknown. With the mode "audit" in `config`, or
            where it ends elsewhere today, that pose is judged as it is, without steps to it.
    """
    clouds, ends_there = (Cloud(target), Cloud(source)), False
    if T_found is None or config.mode != 'audit':
        result = register(*clouds, T_guess, config)
        T = result.T_target_source
        ends_there = T_found is None or _apart(T, T_found, source) <= SAME * result.radius
    if not ends_there:
        result = register(*clouds, T_found, replace(config, mode='audit'))
    means, q, _ = points_with_q(result, *clouds, config)
    poses = T_guess, *result.path[:-1], result.T_target_source
    free = result.motions[~result.observable]
    return view_of(target, source, poses, most, (means, q), free), result


def _apart(T_a, T_b, source):
    """Return how far the farthest of some points are apart at two poses."""
    moved = transform_points(T_a, source) - transform_points(T_b, source)
    return float(np.linalg.norm(moved, axis=1).max())


def _curves(clouds, T_guess, result, config):
    if not result.radius > 0.0:  # too few points: nothing was evaluated
        return
    T, size = result.T_target_source, result.voxel_size
    both = *map(points_of, clouds), T
    near = Cloud(within_reach(*both, 2 * REACH * result.radius)), clouds[1]
    if size not in (None, AUTO):
        near = [each.reduced(size) for each in near]
    landscape = Landscape(*near, result.radius, config.length_scale, config.threads)
    pivot = centroid(landscape, T)
    moved = transform_points(T, points_of(near[1]))
    spread = np.sqrt(np.mean(np.sum(usual(moved - pivot) ** 2, axis=1)))
    guess = _offset_of(T_guess, T, pivot)
    for k, axis in enumerate(AXES):
        unit = 1.0 if k < 3 else 1.0 / spread
        reach = max(REACH * result.radius * unit, 1.2 * abs(guess[k]))
        offsets = np.linspace(-reach, reach, 2 * STEPS + 1)
        moves = np.zeros((len(offsets), 6))
        moves[:, k] = offsets
        q = landscape.at(displaced(T, moves, pivot))
        crests = [
            offsets[STEPS + way * peak]
            for way, side in ((-1, q[STEPS::-1]), (1, q[STEPS:]))
            if (peak := nearest_maximum(side)) is not None
        ]
        scale = 1.0 if k < 3 else np.degrees(1.0)
        shown = (scale * offset for offset in crests)
        yield Curve(axis, scale * offsets, q, float(scale * guess[k]), tuple(map(float, shown)))


def _offset_of(T_guess, T, pivot):
    """Return (6,): by which displacement of the result, see `displaced`, the guess is reached."""
    between = T_guess @ inverse(T)
    turn = Rotation.from_matrix(between[:3, :3])
    shift = transform_points(between, pivot) - pivot
    return np.r_[shift, turn.as_euler('xyz')]


def _values(result):
    said = {
        'status': result.status.value,
        'ended by': result.termination.value,
        'iterations': result.iterations,
        'q_tot': f'{result.q_tot:.5g}',
        'q_mean': f'{result.q_mean:.3g}',
        'overlap': f'{result.overlap:.3f}',
        'radius': f'{result.radius:.3g}',
        'voxel_size': 'points as given' if result.voxel_size is None else f'{result.voxel_size:g}',
    }
    return said | assessment_values(result.assessment, 'the source')
