import dataclasses

import numpy as np
import pytest

from idem_ros.core import InvalidConfig, RegistrationConfig


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        ({'voxel_size': 0}, 'voxel_size is 0'),
        ({'voxel_size': '0.5'}, "voxel_size is '0.5'"),
        ({'a': float('inf')}, 'a is inf'),
        ({'a': True}, 'a is True'),
        ({'radius_schedule': ()}, r'radius_schedule is \(\); give one stage'),
        ({'radius_schedule': 2.0}, 'radius_schedule is 2.0; give one stage'),
        ({'radius_schedule': (2.0, -1.0)}, 'radius_schedule is -1.0'),
        ({'length_scale': 'm'}, "length_scale is 'm'"),
        ({'max_iterations': 0}, 'max_iterations is 0'),
        ({'max_iterations': 2.5}, 'max_iterations is 2.5'),
        ({'threads': 0}, 'threads is 0'),
        ({'rotation_tolerance': -1e-5}, 'rotation_tolerance is -1e-05'),
        ({'translation_tolerance': None}, 'translation_tolerance is None'),
    ],
)
def test_a_value_out_of_range_is_refused_by_name(change, message):
    with pytest.raises(InvalidConfig, match=message):
        RegistrationConfig(**change)


def test_every_parameter_is_described():
    for field in dataclasses.fields(RegistrationConfig):
        assert field.metadata['description']
        assert 'unit' in field.metadata


def test_a_list_of_stages_is_taken_as_a_tuple():
    assert RegistrationConfig(radius_schedule=[2.0, 1.0]).radius_schedule == (2.0, 1.0)


def test_numpys_scalars_are_taken_as_pythons():
    config = RegistrationConfig(
        voxel_size=np.float32(0.5), threads=np.int64(2), radius_schedule=np.array([2, 1], np.int32)
    )
    assert config == RegistrationConfig(voxel_size=0.5, threads=2, radius_schedule=(2, 1))
    assert type(config.voxel_size) is float
    assert type(config.radius_schedule[0]) is int
