"""Everything that decides what comes out of a replay, as a record that JSON can hold, and back."""

import math
from dataclasses import dataclass, field, fields
from typing import Any

from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import IdemError, InvalidConfig
from idem_ros.core.parameter import (
    parameter_name,
    require_count,
    require_one_of,
    require_positive,
)
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.map_target import MapConfig
from idem_ros.pairing.targets import PairingConfig
from idem_ros.recording.part import MAX_CHUNK
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig

IDEM = 'idem'
METHODS = (IDEM, 'icp', 'plane_icp', 'gicp', 'vgicp')
SCAN = 'scan'
SEQUENCES = (SCAN, 'submap')


class UnknownSettings(IdemError):
    """Settings of a record that this version has no such thing for."""


@dataclass(frozen=True)
class Settings:
    """How a recording is replayed, by one method.

    Raises:
        InvalidConfig: a value out of range.
    """

    config: RegistrationConfig = field(default_factory=RegistrationConfig)
    preprocessing: PreprocessingConfig = field(default_factory=PreprocessingConfig)
    pairing: PairingConfig = field(default_factory=PairingConfig)
    guess: GuessConfig = field(default_factory=GuessConfig)
    point_times: PointTimeConfig = field(default_factory=PointTimeConfig)
    map: MapConfig = field(default_factory=MapConfig)
    method: str = IDEM
    """One of `METHODS`."""
    max_distance: float | None = None
    """How far the peers of IDEM look for a correspondence [m]; None: see `peers.Peer`."""
    start: float = 0.0
    """Sources are refined from here on, after the beginning of the recording [s]."""
    duration: float | None = None
    """For so long [s]; None: to the end."""
    every: int = 1
    """Of these sources every n-th is refined, beginning with the first."""
    sequence: str | None = None
    """Odometry over the sources: each against the last one or a submap; None: pairs."""
    max_chunk: int = MAX_CHUNK
    """Chunks of the recording that declare to inflate to more are left out [bytes]."""

    def __post_init__(self):
        if not (math.isfinite(self.start) and self.start >= 0):
            raise InvalidConfig(f'start is {self.start}; it must be seconds from 0')
        if self.duration is not None:
            require_positive('duration', self.duration)
        require_count('every', self.every)
        require_count('max_chunk', self.max_chunk)
        require_one_of('sequence', self.sequence, (None, *SEQUENCES))
        require_one_of('method', self.method, METHODS)
        if self.max_distance is not None:
            require_positive('max_distance', self.max_distance)


def as_record(settings):
    """Return settings as {'parameters': by the node's names, and every other field by its own}."""
    configs, others = {}, {}
    for each in fields(Settings):
        value = getattr(settings, each.name)
        (configs if each.name in _config_types() else others)[each.name] = value
    parameters = {
        parameter_name(each): _json_value(getattr(config, each.name))
        for config in configs.values()
        for each in fields(config)
    }
    return {'parameters': parameters, **others}


def from_record(record):
    """Return the `Settings` of a record that `as_record` made; what it lacks is as by default.

    Raises:
        UnknownSettings: it has a parameter or an option that there is none of here.
        InvalidConfig: a value out of range.
    """
    others = dict(record)
    parameters = dict(others.pop('parameters'))
    try:
        configs = {
            name: config_type(**_taken(config_type, parameters))
            for name, config_type in _config_types().items()
        }
        known = {each.name for each in fields(Settings)} - set(configs)
        unknown = [*parameters, *(others.keys() - known)]
        if unknown:
            raise UnknownSettings(
                f'the settings {", ".join(sorted(unknown))} are unknown to this version'
            )
        return Settings(**configs, **others)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidConfig(f'the settings are none: {error}') from error


def _config_types() -> dict[str, Any]:
    """Return {field of `Settings`: the configuration it holds}."""
    return {
        each.name: each.default_factory
        for each in fields(Settings)
        if hasattr(each.default_factory, '__dataclass_fields__')
    }


def _taken(config_type, parameters):
    """Take the values of a configuration's fields out of a record."""
    return {
        each.name: _value(parameters.pop(parameter_name(each)))
        for each in fields(config_type)
        if parameter_name(each) in parameters
    }


def _json_value(value):
    if isinstance(value, tuple):
        return [number if math.isfinite(number) else str(number) for number in value]
    return value


def _value(recorded):
    return tuple(map(float, recorded)) if isinstance(recorded, list) else recorded
