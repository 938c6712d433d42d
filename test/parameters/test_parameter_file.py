import pytest
from conftest import ROOT

from idem_ros.core import InvalidConfig, RegistrationConfig
from idem_ros.node.config import SubscriptionConfig
from idem_ros.node.interface import CONFIGS
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.parameters.parameter_file import (
    BadParameterFile,
    configs_of,
    read_parameters,
    speaks_to,
)
from idem_ros.refinement.preprocessing import PreprocessingConfig

REPLAYED = tuple(kind for kind in CONFIGS if kind is not SubscriptionConfig)


@pytest.fixture
def parsed(tmp_path):
    def read(text, types=REPLAYED, elsewhere=(SubscriptionConfig,)):
        path = tmp_path / 'params.yaml'
        path.write_text(text)
        parameters, others = read_parameters(path)
        return *configs_of(path, parameters, types, elsewhere), others

    return read


def test_the_file_that_is_shipped_holds_the_defaults(parsed):
    configs, passed, others = parsed((ROOT / 'config' / 'refine.yaml').read_text())
    assert configs == {kind: kind() for kind in REPLAYED}
    assert set(passed) == {'reliability', 'depth', 'target_durability'}
    assert others == []


def test_values_are_what_ros_takes_them_for(parsed):
    text = """/**:
  ros__parameters:
    voxel_size: 1
    rotation_tolerance: 1e-6
    radius_schedule: [4, 1.0]
    max_points: 0
    crop_min: [-.inf, -2, -3.5]
    crop_target: true
    use_sim_time: true
"""
    configs, passed, _ = parsed(text)
    assert configs[RegistrationConfig] == RegistrationConfig(
        voxel_size=1.0, rotation_tolerance=1e-6, radius_schedule=(4.0, 1.0)
    )
    assert configs[PreprocessingConfig] == PreprocessingConfig(
        crop_min=(float('-inf'), -2.0, -3.5), crop_target=True
    )
    assert passed == ['use_sim_time']


@pytest.mark.parametrize('node', ['idem_node', '/idem_node', '/robot/idem_node', '/**'])
def test_the_node_is_meant_by_its_name_in_any_namespace(parsed, node):
    text = f'{node}:\n  ros__parameters:\n    a: 2\nrviz:\n  ros__parameters:\n    a: 3\n'
    configs, _, others = parsed(text)
    assert configs[RegistrationConfig].a == 2.0
    assert others == ['rviz']


def test_namespaces_may_nest(parsed):
    text = """/robot1:
  idem_node:
    ros__parameters:
      a: 2
      initial_guess:
        type: identity
  rviz:
    ros__parameters:
      a: 3
"""
    configs, _, others = parsed(text)
    assert configs[RegistrationConfig].a == 2.0
    assert configs[GuessConfig].type == 'identity'
    assert others == ['/robot1/rviz']


@pytest.mark.parametrize(
    ('name', 'node', 'expected'),
    [
        ('idem_node', '/idem_node', True),
        ('idem_node', '/robot/idem_node', False),
        ('/robot/idem_node', '/robot/idem_node', True),
        ('/**', '/robot/idem_node', True),
        ('/*', '/robot/idem_node', False),
        ('/*', '/idem_node', True),
        ('/**/idem_node', '/idem_node', True),
        ('/**/idem_node', '/a/b/idem_node', True),
        ('/*/idem_node', '/a/b/idem_node', False),
        ('/robot/**', '/robot/front/idem_node', True),
        ('scan_matcher', '/idem_node', False),
    ],
)
def test_a_name_means_the_nodes_that_ros_takes_it_for(name, node, expected):
    assert speaks_to(name, node) is expected


def test_later_sections_win(parsed):
    text = '/**: {ros__parameters: {a: 2.0, threads: 2}}\nidem_node: {ros__parameters: {a: 3.0}}'
    config = parsed(text)[0][RegistrationConfig]
    assert (config.a, config.threads) == (3.0, 2)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('', 'holds no node'),
        ('a: [', 'is no YAML'),
        ('[1, 2]', 'holds no node'),
        ('rviz:\n  ros__parameters:\n    a: 1\n', 'speaks to rviz; it must hold'),
        ('/**:\n  a: 1\n', r'has no ros__parameters'),
        ('/**: {ros__parameters: {voxelsize: 1.0}}', 'sets voxelsize, which no parameter is'),
        ('/**: {ros__parameters: {crop: {min: 1.0}}}', r'sets crop\.min, which no parameter is'),
    ],
)
def test_what_cannot_be_meant_is_refused_by_name(parsed, text, words):
    with pytest.raises(BadParameterFile, match=words) as refused:
        parsed(text)
    assert 'params.yaml' in str(refused.value)
    assert '\n' not in str(refused.value)


@pytest.mark.parametrize(
    ('value', 'words'),
    [('a: -1.0', 'a is -1.0'), ('a: much', "a is 'much'"), ('radius_schedule: 2.0', 'a list')],
)
def test_a_value_out_of_range_is_refused(parsed, value, words):
    with pytest.raises(InvalidConfig, match=words):
        parsed(f'/**: {{ros__parameters: {{{value}}}}}')


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(BadParameterFile, match=r'none.yaml cannot be read'):
        read_parameters(tmp_path / 'none.yaml')
