import dataclasses

import numpy as np
import pytest

from idem_ros.core import Cloud, InvalidConfig, RegistrationConfig, register


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        ({'voxel_size': 0}, 'voxel_size is 0'),
        ({'voxel_size': '0.5'}, "voxel_size is '0.5'"),
        ({'a': float('inf')}, 'a is inf'),
        ({'a': True}, 'a is True'),
        ({'a': 1000}, 'a is 1000; it must be a number from 0.1 to 50'),
        ({'a': 1e300}, r'a is 1e\+300'),
        ({'voxel_size': 1e300}, r'voxel_size is 1e\+300; it must be a number from 1e-09'),
        ({'voxel_size': 1e-300}, 'voxel_size is 1e-300'),
        ({'radius_schedule': (1.0, 2.0)}, r'coarse to fine, as in \(2.0, 1.0\)'),
        ({'radius_schedule': (1e300, 1.0)}, r'radius_schedule is 1e\+300'),
        ({'radius_schedule': (1.0,) * 100_000}, 'has 100000 stages; it must have 16 at most'),
        ({'max_iterations': 10**9}, 'max_iterations is 1000000000; it must be a whole number'),
        ({'rotation_tolerance': 100.0}, 'rotation_tolerance is 100.0'),
        ({'radius_schedule': ()}, r'radius_schedule is \(\); give one stage'),
        ({'radius_schedule': 2.0}, 'radius_schedule is 2.0; it must be a list'),
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


def test_voxels_finer_than_the_coordinates_resolve_are_refused(rng):
    points = rng.uniform(0.0, 1000.0, (100, 3))
    with pytest.raises(InvalidConfig, match='voxel_size is 1e-06, but the cloud reaches'):
        register(points, points, config=RegistrationConfig(voxel_size=1e-6))


def test_a_stray_point_far_off_forbids_no_voxels(rng):
    points = np.vstack([rng.uniform(0.0, 10.0, (1000, 3)), [[1e9, 0.0, 0.0]]])
    assert len(Cloud(points).reduced(0.1)) > 100


@pytest.mark.parametrize('name', ['audit_tolerance', 'model_error'])
@pytest.mark.parametrize('given', [0.1, 'much', (0.1,), (0.1, -1.0), (np.nan, 0.1), (0.1, 200.0)])
def test_a_length_and_an_angle_are_two_numbers_from_zero_on(name, given):
    with pytest.raises(InvalidConfig, match=name):
        RegistrationConfig(**{name: given})
