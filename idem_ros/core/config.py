"""The parameters of a registration, described once for core, node, CLI and docs."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, fields

import numpy as np

from idem_ros.core.exceptions import InvalidConfig

LENGTH_SCALES = ('radius', 'none')
FREE_MOTIONS = ('guess', 'solve')
ASSESSMENTS = ('none', 'verdict', 'swap')
MODES = ('refine', 'audit')


def _parameter(default, description, unit='', choices=None):
    metadata = {'description': description, 'unit': unit}
    return field(default=default, metadata=metadata | ({'choices': choices} if choices else {}))


@dataclass(frozen=True)
class RegistrationConfig:
    """How two clouds are registered; `idem_ros.core.register` reads nothing else."""

    voxel_size: float | None = _parameter(
        None, 'edge of the voxels both clouds are reduced to first; none: points as given', 'm'
    )
    a: float = _parameter(
        1.0,
        'search radius over the mean distance to the fourth neighbour (Eq. 9); the last stage '
        'takes up to twice that where noise fills the ball',
    )
    radius_schedule: tuple[float, ...] = _parameter(
        (8.0, 4.0, 2.0, 1.0),
        'stages, coarse to fine: the radius of each as a multiple of the last',
    )
    length_scale: str = _parameter(
        'radius',
        'unit of length of the entropy: "radius" (dimensionless) or "none" (as given, the paper)',
        choices=LENGTH_SCALES,
    )
    max_iterations: int = _parameter(50, 'most steps of one stage')
    threads: int = _parameter(1, 'threads of one registration; its result is the same for any')
    rotation_tolerance: float = _parameter(
        1e-5, 'a stage has converged when a step turns by less', 'rad'
    )
    translation_tolerance: float = _parameter(
        1e-4, 'a stage has converged when a step moves by less than this multiple of the radius'
    )
    budget_ms: float | None = _parameter(
        None,
        'time after which the best so far is the result, with status "late"; none: no limit, and '
        'the same result in every run',
        'ms',
    )
    free_motions: str = _parameter(
        'guess',
        'motions that no surface holds (along a corridor, about a pole): "guess" leaves them as '
        'the initial guess has them, "solve" follows what little the points say',
        choices=FREE_MOTIONS,
    )
    mode: str = _parameter(
        'refine',
        '"refine" moves the source from the guess; "audit" moves nothing and judges the guess: '
        'the pose of another localiser',
        choices=MODES,
    )
    assessment: str = _parameter(
        'verdict',
        'what is said of a result: "verdict" (can it be trusted, and its covariance), "swap" (and '
        'how far from it the registration of target to source ends: twice the time) or "none"',
        choices=ASSESSMENTS,
    )

    def __post_init__(self):
        for name in parameter_names():
            object.__setattr__(self, name, _plain(getattr(self, name)))
        if self.voxel_size is not None:
            _require_positive('voxel_size', self.voxel_size)
        _require_positive('a', self.a)
        self._check_schedule()
        for factor in self.radius_schedule:
            _require_positive('radius_schedule', factor)
        _require_one_of('length_scale', self.length_scale, LENGTH_SCALES)
        _require_one_of('free_motions', self.free_motions, FREE_MOTIONS)
        _require_one_of('mode', self.mode, MODES)
        _require_one_of('assessment', self.assessment, ASSESSMENTS)
        if self.mode == 'audit' and self.assessment == 'none':
            raise InvalidConfig('mode is audit and assessment none: nothing would be said')
        if self.budget_ms is not None:
            _require_positive('budget_ms', self.budget_ms)
        _require_count('max_iterations', self.max_iterations)
        _require_count('threads', self.threads)
        _require_positive('rotation_tolerance', self.rotation_tolerance)
        _require_positive('translation_tolerance', self.translation_tolerance)

    def _check_schedule(self):
        given = self.radius_schedule
        if not isinstance(given, Iterable) or not (schedule := tuple(map(_plain, given))):
            raise InvalidConfig(
                f'radius_schedule is {given!r}; give one stage at least, as in (1.0,)'
            )
        object.__setattr__(self, 'radius_schedule', schedule)


def parameter_names():
    """Return the names of all fields of `RegistrationConfig`, in order."""
    return tuple(f.name for f in fields(RegistrationConfig))


def _plain(value):
    """Return a NumPy scalar as Python's: a kernel would be compiled anew for its type."""
    return value.item() if isinstance(value, np.generic) else value


def _require_positive(name, value):
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (is_number and math.isfinite(value) and value > 0):
        raise InvalidConfig(f'{name} is {value!r}; it must be a finite number above 0')


def _require_one_of(name, value, choices):
    if value not in choices:
        raise InvalidConfig(f'{name} is {value!r}; it must be one of {choices}')


def _require_count(name, value):
    if isinstance(value, bool) or not (isinstance(value, int) and value >= 1):
        raise InvalidConfig(f'{name} is {value!r}; it must be a whole number from 1')
