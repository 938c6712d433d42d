"""The parameters of a registration, described once for core, node, CLI and docs."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, cast

import numpy as np

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.parameter import parameter, plain, require_fields, require_within

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


@dataclass(frozen=True)
class RegistrationConfig:
    """How two clouds are registered; `idem_ros.core.register` reads nothing else."""

    voxel_size: float | str | None = parameter(
        AUTO,
        'edge of the voxels both clouds are reduced to first; "auto": what suits both, by their '
        'spacing, the thickness of surfaces and the extent; none: points as given',
        'm',
        range=VOXEL_SIZES,
        words=(AUTO,),
    )
    a: float = parameter(
        1.0,
        'search radius over the mean distance to the fourth neighbour (Eq. 9); the last stage '
        'takes up to twice that where noise fills the ball',
        range=(0.1, 50.0),
    )
    radius_schedule: tuple[float, ...] = parameter(
        (8.0, 4.0, 2.0, 1.0),
        'stages, coarse to fine: the radius of each as a multiple of the last',
    )
    length_scale: str = parameter(
        'radius',
        'unit of length of the entropy: "radius" (dimensionless) or "none" (as given, the paper)',
        choices=LENGTH_SCALES,
    )
    max_iterations: int = parameter(50, 'most steps of one stage', range=(1, 10_000))
    threads: int = parameter(
        1, 'threads of one registration; its result is the same for any', range=(1, 1024)
    )
    rotation_tolerance: float = parameter(
        1e-5, 'a stage has converged when a step turns by less', 'rad', range=(1e-12, 1.0)
    )
    translation_tolerance: float = parameter(
        1e-4,
        'a stage has converged when a step moves by less than this multiple of the radius',
        range=(1e-12, 1.0),
    )
    budget_ms: float | None = parameter(
        None,
        'time after which the best so far is the result, with status "late"; none: no limit, and '
        'the same result in every run',
        'ms',
    )
    free_motions: str = parameter(
        'guess',
        'motions that no surface holds (along a corridor, about a pole): "guess" leaves them as '
        'the initial guess has them, "solve" follows what little the points say',
        choices=FREE_MOTIONS,
    )
    mode: str = parameter(
        'refine',
        '"refine" moves the source from the guess; "audit" moves nothing and judges the guess: '
        'the pose of another localiser',
        choices=MODES,
    )
    audit_tolerance: tuple[float, ...] = parameter(
        (0.05, 0.3),
        'how far off a pose that is audited may be, and still be aligned: a distance in the '
        "clouds' unit, and an angle in degrees",
    )
    model_error: tuple[float, ...] = parameter(
        (0.0, 0.0),
        'standard deviation, of each axis, of what no comparison of the two clouds shows: of '
        "calibration, of a map's own bends, of motion within a sweep; added to the covariance. A "
        "distance in the clouds' unit, and an angle in degrees",
    )
    guess_sigma: tuple[float, ...] = parameter(
        (0.0, 0.0),
        'standard deviation, of each axis, of a guess that comes without a covariance, in the '
        "clouds' unit and in degrees: what the clouds hold weakly is weighed against it; 0: "
        'nothing is known of it',
    )
    assessment: str = parameter(
        'verdict',
        'what is said of a result: "verdict" (can it be trusted, and its covariance), "swap" (and '
        'how far from it the registration of target to source ends: twice the time) or "none"',
        choices=ASSESSMENTS,
    )
    motion: str = parameter(
        'none',
        'what is undone of the motion during the sweep of a source whose points have times: '
        '"none" (it stood still), "guess" (as neighbouring guesses have it), "last" (as the last '
        'two usable results have it) or "solve" (found with the pose, from either as a start)',
        choices=MOTIONS,
    )
    twist_sigma: tuple[float, ...] = parameter(
        (0.0, 0.0),
        'with motion "solve", the standard deviation, of each axis, of the twist that the solve '
        "starts from, in the clouds' unit and in degrees a second: how far a sensor of constant "
        'velocity may leave it, or an odometry be off; 0: nothing is known of it',
    )
    motion_reference: str = parameter(
        'stamp',
        'the instant of the sweep at which the pose is that of the source frame: "stamp", or the '
        '"begin", "middle" or "end" of its point times',
        choices=MOTION_REFERENCES,
    )

    def __post_init__(self) -> None:
        require_fields(self)
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

    def _check_schedule(self) -> None:
        schedule = tuple(map(plain, self.radius_schedule))
        if not schedule:
            raise InvalidConfig('radius_schedule is (); give one stage at least, as in (1.0,)')
        if len(schedule) > MOST_STAGES:
            raise InvalidConfig(
                f'radius_schedule has {len(schedule)} stages; it must have {MOST_STAGES} at most'
            )
        for factor in schedule:
            require_within('radius_schedule', factor, FACTORS)
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
        values = tuple(map(plain, cast(Any, given)))
    if len(values) != 2:
        raise InvalidConfig(
            f'{name} is {given!r}; give a length and an angle in degrees, as in (0.05, 0.3)'
        )
    for value, most in zip(values, (VOXEL_SIZES[1], 180.0), strict=True):
        require_within(name, value, (0.0, most))
    return float(values[0]), float(values[1])
