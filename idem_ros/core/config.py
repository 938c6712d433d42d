"""The parameters of a registration, described once for core, node, CLI and docs."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, fields
from itertools import pairwise
from typing import Any, cast

import numpy as np

from idem_ros.core.exceptions import InvalidConfig

LENGTH_SCALES = ('radius', 'none')
FREE_MOTIONS = ('guess', 'solve')
ASSESSMENTS = ('none', 'verdict', 'swap')
MODES = ('refine', 'audit')
MOTIONS = ('none', 'guess', 'last', 'solve')
MOTION_REFERENCES = ('stamp', 'begin', 'middle', 'end')
AUTO = 'auto'
# Beyond these a value is a typing error, or asks for hours: no cloud is registered better by it.
VOXEL_SIZES = 1e-9, 1e6
FACTORS = 0.01, 1000.0
MOST_STAGES = 16


def _parameter(default: Any, description: str, unit: str = '', **metadata: Any) -> Any:
    return field(default=default, metadata={'description': description, 'unit': unit, **metadata})


@dataclass(frozen=True)
class RegistrationConfig:
    """How two clouds are registered; `idem_ros.core.register` reads nothing else."""

    voxel_size: float | str | None = _parameter(
        AUTO,
        'edge of the voxels both clouds are reduced to first; "auto": what suits both, by their '
        'spacing, the thickness of surfaces and the extent; none: points as given',
        'm',
        words=(AUTO,),
    )
    a: float = _parameter(
        1.0,
        'search radius over the mean distance to the fourth neighbour (Eq. 9); the last stage '
        'takes up to twice that where noise fills the ball',
        range=(0.1, 50.0),
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
    max_iterations: int = _parameter(50, 'most steps of one stage', range=(1, 10_000))
    threads: int = _parameter(
        1, 'threads of one registration; its result is the same for any', range=(1, 1024)
    )
    rotation_tolerance: float = _parameter(
        1e-5, 'a stage has converged when a step turns by less', 'rad', range=(1e-12, 1.0)
    )
    translation_tolerance: float = _parameter(
        1e-4,
        'a stage has converged when a step moves by less than this multiple of the radius',
        range=(1e-12, 1.0),
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
    audit_tolerance: tuple[float, ...] = _parameter(
        (0.05, 0.3),
        'how far off a pose that is audited may be, and still be aligned: a distance in the '
        "clouds' unit, and an angle in degrees",
    )
    model_error: tuple[float, ...] = _parameter(
        (0.0, 0.0),
        'standard deviation, of each axis, of what no comparison of the two clouds shows: of '
        "calibration, of a map's own bends, of motion within a sweep; added to the covariance. A "
        "distance in the clouds' unit, and an angle in degrees",
    )
    guess_sigma: tuple[float, ...] = _parameter(
        (0.0, 0.0),
        'standard deviation, of each axis, of a guess that comes without a covariance, in the '
        "clouds' unit and in degrees: what the clouds hold weakly is weighed against it; 0: "
        'nothing is known of it',
    )
    assessment: str = _parameter(
        'verdict',
        'what is said of a result: "verdict" (can it be trusted, and its covariance), "swap" (and '
        'how far from it the registration of target to source ends: twice the time) or "none"',
        choices=ASSESSMENTS,
    )
    motion: str = _parameter(
        'none',
        'what is undone of the motion during the sweep of a source whose points have times: '
        '"none" (it stood still), "guess" (as neighbouring guesses have it), "last" (as the last '
        'two usable results have it) or "solve" (found with the pose, from either as a start)',
        choices=MOTIONS,
    )
    twist_sigma: tuple[float, ...] = _parameter(
        (0.0, 0.0),
        'with motion "solve", the standard deviation, of each axis, of the twist that the solve '
        "starts from, in the clouds' unit and in degrees a second: how far a sensor of constant "
        'velocity may leave it, or an odometry be off; 0: nothing is known of it',
    )
    motion_reference: str = _parameter(
        'stamp',
        'the instant of the sweep at which the pose is that of the source frame: "stamp", or the '
        '"begin", "middle" or "end" of its point times',
        choices=MOTION_REFERENCES,
    )

    def __post_init__(self) -> None:
        for each in fields(self):
            value = _plain(getattr(self, each.name))
            object.__setattr__(self, each.name, value)
            if 'range' in each.metadata:
                _require_within(each.name, value, each.metadata['range'], each.type is int)
            if 'choices' in each.metadata:
                _require_one_of(each.name, value, each.metadata['choices'])
        if self.voxel_size not in (None, AUTO):
            _require_within('voxel_size', self.voxel_size, VOXEL_SIZES, words=(AUTO,))
        self._check_schedule()
        for name in ('audit_tolerance', 'model_error', 'guess_sigma', 'twist_sigma'):
            object.__setattr__(self, name, _length_and_angle(name, getattr(self, name)))
        if self.mode == 'audit' and self.assessment == 'none':
            raise InvalidConfig('mode is audit and assessment none: nothing would be said')
        for name in ('guess_sigma', 'twist_sigma'):
            if any(getattr(self, name)) and self.assessment == 'none':
                raise InvalidConfig(
                    f'{name} is given and assessment none: there is no covariance to weigh it by'
                )
        if self.budget_ms is not None:
            _require_positive('budget_ms', self.budget_ms)

    def _check_schedule(self) -> None:
        given = self.radius_schedule
        if not isinstance(given, Iterable) or not (schedule := tuple(map(_plain, given))):
            raise InvalidConfig(
                f'radius_schedule is {given!r}; give one stage at least, as in (1.0,)'
            )
        if len(schedule) > MOST_STAGES:
            raise InvalidConfig(
                f'radius_schedule has {len(schedule)} stages; it must have {MOST_STAGES} at most'
            )
        for factor in schedule:
            _require_within('radius_schedule', factor, FACTORS)
        if any(later > earlier for earlier, later in pairwise(schedule)):
            raise InvalidConfig(
                f'radius_schedule is {schedule}; it must go from coarse to fine, as in '
                f'{tuple(sorted(schedule, reverse=True))}'
            )
        object.__setattr__(self, 'radius_schedule', schedule)


def _length_and_angle(name: str, given: Any) -> tuple[float, float]:
    """Return a length and an angle in degrees, from 0 on, as a tuple."""
    values: tuple[Any, ...] = ()
    if isinstance(given, (tuple, list, np.ndarray)):
        values = tuple(map(_plain, cast(Any, given)))
    if len(values) != 2:
        raise InvalidConfig(
            f'{name} is {given!r}; give a length and an angle in degrees, as in (0.05, 0.3)'
        )
    for value, most in zip(values, (VOXEL_SIZES[1], 180.0), strict=True):
        _require_within(name, value, (0.0, most))
    return float(values[0]), float(values[1])


def _plain(value: Any) -> Any:
    """Return a NumPy scalar as Python's: a kernel would be compiled anew for its type."""
    return cast(Any, value).item() if isinstance(value, np.generic) else value


def _require_positive(name: str, value: Any) -> None:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (is_number and math.isfinite(value) and value > 0):
        raise InvalidConfig(f'{name} is {value!r}; it must be a finite number above 0')


def _require_one_of(name: str, value: Any, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise InvalidConfig(f'{name} is {value!r}; it must be one of {choices}')


def _require_within(
    name: str,
    value: Any,
    limits: tuple[float, float],
    is_whole: bool = False,
    words: tuple[str, ...] = (),
) -> None:
    low, high = limits
    types = int if is_whole else (int, float)
    is_number = isinstance(value, types) and not isinstance(value, bool)
    if not (is_number and low <= value <= high):
        kind = 'whole number' if is_whole else 'number'
        right = ' or '.join([f'a {kind} from {low:g} to {high:g}', *map(repr, words)])
        raise InvalidConfig(f'{name} is {value!r}; it must be {right}')
