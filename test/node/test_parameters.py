from dataclasses import fields, replace

import pytest
from live import own_graph
from rclpy.node import Node
from rclpy.parameter import Parameter

from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.parameter import parameter_name
from idem_ros.node.config import SubscriptionConfig
from idem_ros.node.interface import CONFIGS
from idem_ros.node.parameters import declare_parameters, read_config
from idem_ros.parameters.fields import default_of
from idem_ros.refinement.preprocessing import PreprocessingConfig


@pytest.fixture(scope='module')
def context():
    with own_graph() as context:
        yield context


@pytest.fixture
def make_node(context):
    nodes = []

    def make(**values):
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        node = Node('parameters', context=context, parameter_overrides=overrides)
        nodes.append(node)
        declare_parameters(node)
        return node

    yield make
    for node in nodes:
        node.destroy_node()


@pytest.mark.parametrize('config_type', CONFIGS)
def test_every_field_is_declared_with_its_description(make_node, config_type):
    node = make_node()
    for field in fields(config_type):
        descriptor = node.describe_parameter(parameter_name(field))
        assert descriptor.description.startswith(field.metadata['description'])
        assert field.metadata['unit'] in descriptor.description


@pytest.mark.parametrize('config_type', CONFIGS)
def test_defaults_come_back_unchanged(make_node, config_type):
    assert read_config(make_node(), config_type) == config_type()


@pytest.mark.parametrize('config_type', CONFIGS)
def test_every_number_is_declared_with_a_range_that_holds_its_default(make_node, config_type):
    node = make_node()
    for field in fields(config_type):
        default = default_of(field)
        if isinstance(default, (bool, str, list)):
            continue
        descriptor = node.describe_parameter(parameter_name(field))
        (limits,) = (*descriptor.integer_range, *descriptor.floating_point_range)
        assert limits.from_value <= default <= limits.to_value
        assert bool(descriptor.integer_range) is isinstance(default, int)


def test_whole_zero_and_lists_reach_the_points_that_take_part(make_node):
    given = {'max_points': 0, 'min_range': 1, 'crop_min': [-1, -2, -3]}
    config = read_config(make_node(**given), PreprocessingConfig)
    assert config == PreprocessingConfig(min_range=1.0, crop_min=(-1.0, -2.0, -3.0))
    config = read_config(make_node(max_points=7, crop_target=True), PreprocessingConfig)
    assert config == PreprocessingConfig(max_points=7, crop_target=True)


def test_description_says_that_zero_means_none(make_node):
    assert make_node().describe_parameter('voxel_size').description.endswith('0.0 means none')


def test_values_given_to_the_node_reach_the_configuration(make_node):
    given = {
        'voxel_size': 0.5,
        'a': 1.5,
        'radius_schedule': [3.0, 1.0],
        'length_scale': 'none',
        'max_iterations': 7,
    }
    config = read_config(make_node(**given), RegistrationConfig)
    assert config == replace(
        RegistrationConfig(), **{**given, 'radius_schedule': tuple(given['radius_schedule'])}
    )


def test_whole_numbers_serve_where_real_ones_are_meant(make_node):
    node = make_node(voxel_size=1, a=2, radius_schedule=[4, 1])
    config = read_config(node, RegistrationConfig)
    assert (config.voxel_size, config.a, config.radius_schedule) == (1.0, 2.0, (4.0, 1.0))
    assert all(isinstance(value, float) for value in (config.voxel_size, config.a))


def test_voxel_size_of_whole_zero_is_none(make_node):
    assert read_config(make_node(voxel_size=0), RegistrationConfig).voxel_size is None


@pytest.mark.parametrize(
    ('name', 'value', 'reason'),
    [
        ('a', -1.0, 'from 0.1 to 50'),
        ('a', 'wide', 'number'),
        ('a', True, 'number'),
        ('voxel_size', -0.5, 'from 1e-09'),
        ('voxel_size', False, 'number'),
        ('radius_schedule', 4.0, 'list'),
        ('radius_schedule', '4,2,1', 'list'),
        ('radius_schedule', [4.0, 0.0], 'from 0.01'),
        ('length_scale', 'metre', 'one of'),
        ('max_iterations', 0, 'from 1'),
        ('max_iterations', 2.5, 'whole'),
    ],
)
def test_bad_value_is_refused_with_its_name_and_what_would_be_right(
    make_node, name, value, reason
):
    with pytest.raises(InvalidConfig, match=f'{name}.*{reason}'):
        read_config(make_node(**{name: value}), RegistrationConfig)


@pytest.mark.parametrize(
    ('name', 'value', 'reason'),
    [
        ('reliability', 'best', 'one of'),
        ('target_durability', 'latched', 'one of'),
        ('depth', 0, 'from 1'),
        ('depth', 1.5, 'whole'),
        ('depth', True, 'whole'),
    ],
)
def test_bad_quality_of_service_is_refused_with_what_would_be_right(
    make_node, name, value, reason
):
    with pytest.raises(InvalidConfig, match=f'{name}.*{reason}'):
        read_config(make_node(**{name: value}), SubscriptionConfig)


def test_values_about_to_be_set_take_the_place_of_the_nodes_own(make_node):
    node = make_node(a=1.5, max_iterations=7)
    config = read_config(node, RegistrationConfig, [Parameter('a', value=3)])
    assert (config.a, config.max_iterations) == (3.0, 7)


def test_quality_of_service_cannot_be_changed_while_the_node_runs(make_node):
    node = make_node()
    (result,) = node.set_parameters([Parameter('depth', value=9)])
    assert not result.successful
    assert node.get_parameter('depth').value == SubscriptionConfig().depth
