"""The files that a robot starts the node with."""

import runpy
import sys
from types import ModuleType, SimpleNamespace

import pytest
from live import rclpy  # noqa: F401  (the files are for a robot)

# isort: split
import yaml
from conftest import ROOT

from idem_ros.node.interface import INPUTS, parameter_fields
from idem_ros.parameters import default_of, parameter_name


def flat(group, prefix=''):
    """Yield (name, value) of the parameters of a group, named as ROS names those of its groups."""
    for name, value in group.items():
        if isinstance(value, dict):
            yield from flat(value, f'{prefix}{name}.')
        else:
            yield prefix + name, value


def test_parameter_file_holds_every_parameter_with_its_default():
    content = yaml.safe_load((ROOT / 'config' / 'refine.yaml').read_text())
    given = dict(flat(content['/**']['ros__parameters']))
    expected = parameter_fields()
    assert given == {parameter_name(field): default_of(field) for field in expected}
    assert list(given) == [parameter_name(field) for field in expected]


@pytest.fixture
def launched(monkeypatch):
    """What the launch file declares, where `launch` is not installed (it has no wheel)."""

    def record(*positional, **keywords):
        return SimpleNamespace(positional=positional, **keywords)

    contents = {
        'ament_index_python.packages': {'get_package_share_directory': lambda name: str(ROOT)},
        'launch': {'LaunchDescription': list},
        'launch.actions': {'DeclareLaunchArgument': record},
        'launch.substitutions': {'LaunchConfiguration': lambda name: f'$({name})'},
        'launch_ros': {},
        'launch_ros.actions': {'Node': record},
    }
    for name, attributes in contents.items():
        module = ModuleType(name)
        vars(module).update(attributes)
        monkeypatch.setitem(sys.modules, name, module)
    file = runpy.run_path(str(ROOT / 'launch' / 'refine.launch.py'))
    return file['generate_launch_description']()


def test_launch_file_starts_the_node_that_setup_installs(launched):
    node = launched[-1]
    assert (node.package, node.executable) == ('idem_ros', 'idem_node')
    assert f"'{node.executable} = idem_ros.node" in (ROOT / 'setup.py').read_text()


def test_launch_file_remaps_every_input_by_an_argument(launched):
    *arguments, node = launched
    names = [argument.positional[0] for argument in arguments]
    assert dict(node.remappings) == {topic.name: f'$({name})' for name, topic in INPUTS.items()}
    assert {value.strip('$()') for value in dict(node.remappings).values()} <= set(names)


def test_launch_file_takes_the_parameter_file_that_exists(launched):
    (argument,) = [each for each in launched[:-1] if each.positional == ('params_file',)]
    assert argument.default_value == str(ROOT / 'config' / 'refine.yaml')
    assert launched[-1].parameters[0] == '$(params_file)'
