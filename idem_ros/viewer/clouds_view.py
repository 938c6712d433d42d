"""Two clouds as the viewer draws them: some of their points, and the poses to see them at."""

import json
from base64 import b64encode
from dataclasses import dataclass, field

import numpy as np

from idem_ros.core.geometry.se3 import transform_points

GUESS, REFINED = 'at the guess', 'refined'
AROUND = 0.2  # sizes of the source that the target is shown beyond it
SEED = 0


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
