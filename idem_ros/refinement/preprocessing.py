"""What is left out of the clouds before they are registered: by range, by a box, by number."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.exceptions import InvalidCloud, InvalidConfig
from idem_ros.core.parameter import parameter, require_fields

SEED = 0


@dataclass(frozen=True)
class PreprocessingConfig:
    """Which points of the clouds take part; by default all.

    Range limits and crop box hold in a cloud's own frame, whose origin is taken for the sensor.
    That is so for a scan, not for a map: they leave the target alone unless `crop_target`.
    """

    min_range: float | None = parameter(
        None, 'points nearer to the origin of their frame are left out', 'm'
    )
    max_range: float | None = parameter(
        None, 'points farther from the origin of their frame are left out', 'm'
    )
    crop_min: tuple[float, ...] = parameter(
        (-math.inf,) * 3, 'lowest x, y, z of the box that points must lie in, in their frame', 'm'
    )
    crop_max: tuple[float, ...] = parameter(
        (math.inf,) * 3, 'highest x, y, z of the box that points must lie in, in their frame', 'm'
    )
    crop_target: bool = parameter(
        False,
        'whether min_range, max_range, crop_min and crop_max hold for the target, too, in its own '
        'frame: true where it is a scan, false where it is a map',
    )
    max_points: int | None = parameter(
        None,
        'most points of each cloud; of more, one of each run of as many as it takes is kept, '
        'the same ones every time',
    )

    def __post_init__(self):
        require_fields(self)
        if self.min_range and self.max_range and self.min_range >= self.max_range:
            raise InvalidConfig(
                f'min_range is {self.min_range}, max_range is {self.max_range}; '
                'the first must be smaller'
            )
        for name in ('crop_min', 'crop_max'):
            object.__setattr__(self, name, _checked_corner(name, getattr(self, name)))
        if not all(low < high for low, high in zip(self.crop_min, self.crop_max, strict=True)):
            raise InvalidConfig(
                f'crop_min is {self.crop_min}, crop_max is {self.crop_max}; '
                'the first must be smaller in x, y and z'
            )

    @property
    def crops(self):
        """Whether anything but the number of points is limited."""
        is_boxed = any(map(math.isfinite, (*self.crop_min, *self.crop_max)))
        return bool(self.min_range or self.max_range or is_boxed)


@dataclass(frozen=True)
class Preprocessed:
    """The points that take part, and how many do not."""

    points: NDArray[np.float64]
    """(N, 3), in the order they came."""
    cropped: int
    """Points outside of the range limits or the crop box."""
    thinned: int
    """Points left out for `max_points`."""
    kept: NDArray[np.intp] | slice
    """Which of the points given they are, as an index."""


def preprocess(points, config, is_target=False):
    """Leave out of a cloud what its configuration says.

    Args:
        points: (N, 3) in the cloud's own frame; N >= 1; left untouched.
        config: `PreprocessingConfig`.
        is_target: whether it is the target, which `crop_target` decides about.

    Returns:
        `Preprocessed`, with at least one point.

    Raises:
        InvalidCloud: no point is left; the message names the parameters and their shares.
    """
    kept, inside = slice(None), len(points)
    if config.crops and (config.crop_target or not is_target):
        kept = np.flatnonzero(_inside(points, config))
        inside = len(kept)
    if config.max_points is not None and inside > config.max_points:
        drawn = _thinned(inside, config.max_points)
        kept = drawn if isinstance(kept, slice) else kept[drawn]
    left = points if isinstance(kept, slice) else points[kept]
    return Preprocessed(left, len(points) - inside, inside - len(left), kept)


def _inside(points, config):
    distance = np.sqrt(np.einsum('ij,ij->i', points, points))
    near = distance < (config.min_range or 0.0)
    far = distance > (config.max_range or math.inf)
    outside = ((points < config.crop_min) | (points > config.crop_max)).any(axis=1)
    inside = ~(near | far | outside)
    if not inside.any():
        shares = {
            f'are nearer than min_range {config.min_range} m': near,
            f'farther than max_range {config.max_range} m': far,
            f'outside of crop_min {list(config.crop_min)} to crop_max {list(config.crop_max)}': (
                outside
            ),
        }
        reasons = [f'{share.sum()} {what}' for what, share in shares.items() if share.any()]
        raise InvalidCloud(f'none of its {len(points)} points is left: {", ".join(reasons)}')
    return inside


def _thinned(n, most):
    """Return the indices of one of n points, drawn by chance, of each of `most` runs.

    The runs are of nearly equal length.

    A fixed stride would meet the same rings of a LiDAR again and again; the seed is always the
    same one, so that a cloud is always thinned the same way.
    """
    start = np.arange(most + 1) * n // most
    drawn = np.random.default_rng(SEED).random(most)
    return start[:-1] + (drawn * np.diff(start)).astype(np.int64)


def _checked_corner(name, corner):
    corner = tuple(corner)
    is_real = all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in corner)
    if len(corner) != 3 or not is_real or any(map(math.isnan, corner)):
        raise InvalidConfig(f'{name} is {list(corner)}; it must be three numbers: x, y, z')
    return tuple(float(value) for value in corner)
