"""The files that a robot starts the node with."""

import re
import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
from live import rclpy  # noqa: F401  (the files are for a robot)

# isort: split
import yaml
from conftest import ROOT

from idem_ros.commands.main import _parser
from idem_ros.node.interface import INPUTS, OUTPUTS, parameter_fields
from idem_ros.node.loopback import loopback_environment
from idem_ros.parameters import default_of, parameter_name

READY_LINE = b'[INFO] [1.5] [idem_node]: ready: listens to /target\n'


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


def recorded(*kinds):
    """Return what stands in for kinds of actions: {kind: what keeps its arguments}."""

    def recording(kind):
        return lambda *positional, **keywords: SimpleNamespace(
            kind=kind, positional=positional, **keywords
        )

    return {kind: recording(kind) for kind in kinds}


@pytest.fixture
def launched(monkeypatch):
    """What a launch file declares, {kind: actions}; `launch` has no wheel and is stood in for."""

    contents = {
        'ament_index_python.packages': {'get_package_share_directory': lambda name: str(ROOT)},
        'launch': {'LaunchDescription': list},
        'launch.actions': recorded(
            'DeclareLaunchArgument',
            'ExecuteProcess',
            'RegisterEventHandler',
            'SetEnvironmentVariable',
            'UnregisterEventHandler',
        ),
        'launch.conditions': {'IfCondition': lambda name: name},
        'launch.event_handlers': recorded('OnProcessIO'),
        'launch.substitutions': {'LaunchConfiguration': lambda name: f'$({name})'},
        'launch_ros': {},
        'launch_ros.actions': recorded('Node'),
        'launch_ros.substitutions': {'ExecutableInPackage': lambda *names: '/'.join(names[::-1])},
    }
    for name, attributes in contents.items():
        module = ModuleType(name)
        vars(module).update(attributes)
        monkeypatch.setitem(sys.modules, name, module)

    def run(name):
        file = runpy.run_path(str(ROOT / 'launch' / f'{name}.launch.py'))
        actions = file['generate_launch_description']()
        kinds = {each.kind for each in actions}
        return {kind: [each for each in actions if each.kind == kind] for kind in kinds}

    return run


def arguments_of(actions):
    return {each.positional[0]: each.default_value for each in actions['DeclareLaunchArgument']}


def node_of(actions, package):
    (node,) = [each for each in actions['Node'] if each.package == package]
    return node


both = pytest.mark.parametrize('name', ['refine', 'replay'])


@both
def test_launch_file_starts_the_node_that_setup_installs(launched, name):
    node = node_of(launched(name), 'idem_ros')
    assert f"'{node.executable} = idem_ros.node" in (ROOT / 'setup.py').read_text()


@both
def test_launch_file_remaps_every_input_by_an_argument(launched, name):
    actions = launched(name)
    remapped = dict(node_of(actions, 'idem_ros').remappings)
    assert remapped == {topic.name: f'$({name})' for name, topic in INPUTS.items()}
    assert {value.strip('$()') for value in remapped.values()} <= set(arguments_of(actions))


@both
def test_launch_file_takes_the_parameter_file_that_exists(launched, name):
    actions = launched(name)
    assert arguments_of(actions)['params_file'] == str(ROOT / 'config' / 'refine.yaml')
    assert node_of(actions, 'idem_ros').parameters[0] == '$(params_file)'


@both
def test_every_argument_is_used_and_every_used_one_is_declared(launched, name):
    text = (ROOT / 'launch' / f'{name}.launch.py').read_text()
    used = {*re.findall(r"LaunchConfiguration\('(\w+)'\)", text), *INPUTS}
    assert used == set(arguments_of(launched(name)))


@both
def test_rviz_is_started_where_it_is_asked_for_with_the_topics_of_the_node(launched, name):
    rviz = node_of(launched(name), 'rviz2')
    assert rviz.condition == '$(rviz)'
    file = rviz.arguments[rviz.arguments.index('-d') + 1]
    topics = {
        each['Topic']['Value']
        for each in yaml.safe_load(Path(file).read_text())['Visualization Manager']['Displays']
        if 'Topic' in each
    }
    assert set(dict(rviz.remappings)) <= {*topics, '/source'}
    published = {topic.name.replace('~', '/idem_node') for topic in OUTPUTS.values()}
    assert topics - {'/target'} <= published


def test_rviz_and_the_profile_for_large_clouds_are_off_by_default(launched):
    actions = launched('refine')
    arguments = arguments_of(actions)
    assert (arguments['rviz'], arguments['large_clouds']) == ('false', 'false')
    (profile,) = actions['SetEnvironmentVariable']
    assert profile.condition == '$(large_clouds)'
    assert_is_the_profile(profile)


def assert_is_the_profile(action):
    name, file = action.positional
    assert loopback_environment()[name] == file


def test_replay_listens_as_the_player_publishes(launched):
    actions = launched('replay')
    _, *parameters = node_of(actions, 'idem_ros').parameters
    given = {name: value for each in parameters for name, value in each.items()}
    assert given == {
        'use_sim_time': True,
        'reliability': 'reliable',
        'target_durability': '$(target_durability)',
    }
    assert arguments_of(actions)['target_durability'] == 'transient_local'
    assert_is_the_profile(actions['SetEnvironmentVariable'][0])


def test_replay_plays_once_when_the_node_says_that_it_is_ready(launched):
    actions = launched('replay')
    (handler,) = actions['RegisterEventHandler'][0].positional
    assert handler.target_action is node_of(actions, 'idem_ros')
    assert handler.on_stderr(SimpleNamespace(text=b'compiling kernels')) is None
    unregistered, play = handler.on_stderr(SimpleNamespace(text=READY_LINE))
    assert unregistered.positional == (handler,)
    idem, *arguments = play.cmd
    assert idem == 'idem_ros/idem'
    bag = str(ROOT / 'bags' / 'demo.mcap')
    words = [{'$(bag)': bag, '$(rate)': '1.0'}.get(word, word) for word in arguments]
    parsed = _parser().parse_args(words)
    assert (parsed.bag, parsed.rate, parsed.clock) == (bag, 1.0, True)


def test_line_that_starts_the_player_is_what_the_node_says():
    said = (ROOT / 'idem_ros' / 'node' / 'live_registration.py').read_text()
    assert 'ready: listens to' in said
