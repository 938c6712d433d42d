import json
import math
from dataclasses import fields

import pytest

from idem_ros.core import InvalidConfig, RegistrationConfig
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.targets import PairingConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.replay.settings import Settings, UnknownSettings, as_record, from_record

CHANGED = Settings(
    RegistrationConfig(voxel_size=0.25, radius_schedule=(4.0, 1.0), length_scale='none'),
    PreprocessingConfig(min_range=1.0, crop_min=(-1.0, -2.0, -math.inf), crop_target=True),
    PairingConfig(pairing='nearest', pairing_tolerance=0.2),
    GuessConfig(type='odometry', max_age=None),
)


def through_json(settings):
    return json.loads(json.dumps(as_record(settings), allow_nan=False))


@pytest.mark.parametrize('settings', [Settings(), CHANGED])
def test_settings_come_back_from_json(settings):
    assert from_record(through_json(settings)) == settings


def test_the_parameters_have_the_names_of_the_node():
    record = as_record(CHANGED)
    assert record['parameters']['voxel_size'] == 0.25
    assert record['parameters']['crop_target'] is True
    assert {field.name for field in fields(RegistrationConfig)} <= set(record['parameters'])


def test_what_a_record_lacks_is_as_by_default():
    record = through_json(CHANGED)
    del record['parameters']['voxel_size'], record['method']
    assert from_record(record).config.voxel_size == 'auto'
    assert from_record(record).method == 'idem'


def test_what_is_unknown_or_out_of_range_is_refused_by_name():
    record = through_json(Settings())
    with pytest.raises(UnknownSettings, match='colour, depth_of_field'):
        from_record(
            {**record, 'colour': 1, 'parameters': {**record['parameters'], 'depth_of_field': 2}}
        )
    with pytest.raises(InvalidConfig, match='method is .lidar.; it must be one of'):
        from_record({**record, 'method': 'lidar'})
    with pytest.raises(InvalidConfig, match='voxel_size is -1'):
        from_record({**record, 'parameters': {'voxel_size': -1.0}})
