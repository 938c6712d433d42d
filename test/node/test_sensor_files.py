"""config/*.yaml for kinds of sensors: accepted by the node, and as good as their comments say."""

import pytest
from conftest import ROOT
from live import own_graph
from sensors import pairs

# isort: split
from idem_ros.core import Cloud, RegistrationConfig, register
from idem_ros.node.interface import CONFIGS
from idem_ros.node.registration_node import RegistrationNode
from idem_ros.parameters.parameter_file import configs_of, read_parameters
from idem_ros.refinement.preprocessing import PreprocessingConfig, preprocess
from idem_ros.replay.frames import rotation_error_deg, translation_error_m

OTHERS = 'audit', 'diagnostic'  # for another use, or another node
FILES = [
    path for path in sorted((ROOT / 'config').glob('*.yaml')) if not path.stem.startswith(OTHERS)
]
LARGEST = {  # [deg], [m]: what the comments of the files say, with room for a single pair
    'depth_camera': (0.3, 0.03),
    'lidar_16': (0.2, 0.03),
    'lidar_64': (0.03, 0.008),
}


@pytest.mark.parametrize('file', FILES, ids=lambda file: file.stem)
def test_node_takes_every_parameter_of_the_file(file):
    parameters, others = read_parameters(file)
    assert not others
    arguments = ['--ros-args', '--params-file', str(file)]
    with own_graph() as context:
        node = RegistrationNode(context=context, cli_args=arguments)
        try:
            taken = {name: node.get_parameter(name).value for name in parameters}
        finally:
            node.destroy_node()
    assert {name: listed(value) for name, value in taken.items()} == parameters


def listed(value):
    return value if isinstance(value, (str, bool, int, float)) else list(value)


@pytest.mark.parametrize('sensor', LARGEST)
def test_scans_of_the_sensor_are_refined_as_the_file_says(sensor):
    file = ROOT / 'config' / f'{sensor}.yaml'
    parameters, _ = read_parameters(file)
    configs, _ = configs_of(file, parameters, CONFIGS)
    ((target, source, guess, truth),) = pairs(sensor, 1)
    points = [
        preprocess(each, configs[PreprocessingConfig], is_target).points
        for each, is_target in ((target, True), (source, False))
    ]
    result = register(*map(Cloud, points), guess, configs[RegistrationConfig])
    largest_deg, largest_m = LARGEST[sensor]
    assert rotation_error_deg(result.T_target_source, truth) < largest_deg
    assert translation_error_m(result.T_target_source, truth) < largest_m
