"""What can be set of a rig that is watched, and what a calibration decides itself."""

from dataclasses import dataclass

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.parameter import parameter, require_fields

# of `RegistrationConfig`: clouds are put to one time first, and every pose is judged
DECIDED = ('motion', 'motion_reference', 'twist_sigma', 'mode', 'assessment', 'guess_sigma')
RELIABILITIES = 'best_effort', 'reliable'


@dataclass(frozen=True)
class RigWatchConfig:
    """A rig that is watched: its sensors, where they should be, and how often they are held to it.

    Raises:
        InvalidConfig: a value cannot be used.
    """

    extrinsics: str = parameter(
        '',
        'where the sensors should be: the extrinsics.yaml of idem calibrate, whose covariances '
        'count, or another YAML or a URDF, which are taken for exact; to be given',
        fixed=True,
    )
    topics: tuple[str, ...] = parameter(
        (),
        'PointCloud2 of each sensor, two at least, the reference of the extrinsics first; to be '
        'given',
        fixed=True,
    )
    period: float = parameter(
        10.0, 'from one instant that is looked at to the next', 's', range=(0.01, 86400.0)
    )
    instants: int = parameter(
        5, 'how many of the last instants are made one', range=(1, 100), fixed=True
    )
    reliability: str = parameter(
        'best_effort',
        'of the subscriptions: "best_effort" hears every publisher, but may lose large clouds; '
        '"reliable" is deaf to publishers that offer best effort only',
        choices=RELIABILITIES,
        fixed=True,
    )

    def __post_init__(self):
        require_fields(self)
        if not all(isinstance(each, str) for each in self.topics):
            raise InvalidConfig(f'topics is {self.topics!r}; it must be a list of names')
        if len(set(self.topics)) < len(self.topics):
            raise InvalidConfig(f'topics is {self.topics!r}; each sensor has a topic of its own')


def require_rig(config: RigWatchConfig) -> None:
    """Refuse a configuration that names no rig.

    Raises:
        InvalidConfig: it says what is to be given.
    """
    if not config.extrinsics:
        raise InvalidConfig('extrinsics is empty; give the file that idem calibrate --out wrote')
    if len(config.topics) < 2:
        raise InvalidConfig(
            f'topics is {list(config.topics)!r}; give those of two sensors at least, the '
            'reference first'
        )
