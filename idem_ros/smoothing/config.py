"""How a trajectory is made consistent: which scans, how many at once, where loops are sought."""

from dataclasses import dataclass

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.parameter import parameter, require_fields, require_positive

WINDOWS = 2, 50


@dataclass(frozen=True)
class SmoothingConfig:
    """What decides how scans are joined, beside how clouds are registered.

    Raises:
        InvalidConfig: a value out of range.
    """

    keyframe_distance: float | None = parameter(
        None,
        'a scan is a keyframe where the sensor has moved so far since the last one; none: a tenth '
        'of the median range of the first scan',
        'm',
    )
    keyframe_turn: float = parameter(
        20.0, 'or has turned by so much since', 'deg', range=(1.0, 180.0)
    )
    window: int = parameter(
        6,
        'keyframes that are joined at once; each window overlaps the next by half',
        range=WINDOWS,
    )
    reach: float | None = parameter(
        None,
        'keyframes long after one another that are no farther apart are tried as a loop; none: '
        'the median range of the first scan',
        'm',
    )
    odometry_sigma: tuple[float, ...] = parameter(
        (0.03, 0.1),
        'standard deviation, of each axis, of what the trajectory says of a metre travelled, in '
        'metres and degrees: what the clouds leave open is as it says',
    )

    def __post_init__(self):
        require_fields(self)
        sigma = tuple(self.odometry_sigma)
        if len(sigma) != 2:
            raise InvalidConfig(
                f'odometry_sigma is {sigma}; give metres and degrees a metre, as in (0.03, 0.1)'
            )
        for value in sigma:
            require_positive('odometry_sigma', value)
        object.__setattr__(self, 'odometry_sigma', tuple(map(float, sigma)))
