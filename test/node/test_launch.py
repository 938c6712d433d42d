"""The files that a robot starts the node with."""

import sys
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace

import launch_stand_in
import pytest
from launch_stand_in import Launched
from live import rclpy  # noqa: F401  (the files are for a robot)

# isort: split
import yaml
from conftest import ROOT
from parameter_files import parameters_in

from idem_ros.commands.main import command_line
from idem_ros.core.parameter import parameter_name
from idem_ros.node.environment import loopback_environment
from idem_ros.node.interface import INPUTS, OUTPUTS, RIG_CONFIGS, parameter_fields
from idem_ros.parameters.fields import default_of
from idem_ros.parameters.launch_arguments import LaunchRefused, launched_file

READY_LINE = b'[INFO] [1.5] [idem_node]: ready: listens to /target\n'
DEMO = ROOT / 'bags' / 'demo.mcap'
RIG_PARAMETERS = {parameter_name(field) for kind in RIG_CONFIGS for field in fields(kind)}
PARAMETERS = (
    *('voxel_size', 'mode', 'reliability'),
    *('target_durability', 'target_file', 'target_frame'),
)


def test_parameter_file_holds_every_parameter_with_its_default():
    given = parameters_in(ROOT / 'config' / 'refine.yaml')
    expected = parameter_fields()
    assert given == {parameter_name(field): default_of(field) for field in expected}
    assert list(given) == [parameter_name(field) for field in expected]


@pytest.fixture
def launch(monkeypatch):
    """Launch a file by its name as `ros2 launch` does, or as a file that includes it."""
    launch_stand_in.installed(monkeypatch)

    def run(name, *arguments, by='ros2'):
        file = ROOT / 'launch' / f'{name}.launch.py'
        words = [by, 'launch', 'idem_ros', file.name] if by == 'ros2' else [by]
        monkeypatch.setattr(sys, 'argv', [*words, *arguments])
        if name == 'replay' and not any(word.startswith('bag:=') for word in arguments):
            arguments = (*arguments, f'bag:={DEMO}')
        return Launched(file, *arguments)

    return run


both = pytest.mark.parametrize('name', ['refine', 'replay'])


@both
def test_launch_file_starts_the_node_that_setup_installs(launch, name):
    node = launch(name).node('idem_ros')
    assert f"'{node.executable} = idem_ros.node" in (ROOT / 'setup.py').read_text()


@both
def test_launch_file_remaps_every_input_by_an_argument(launch, name):
    arguments = [f'{each}:=/mine/{each}' for each in INPUTS]
    remapped = launch(name, *arguments).remappings('idem_ros')
    assert remapped == {topic.name: f'/mine/{name}' for name, topic in INPUTS.items()}


@both
def test_launch_file_takes_the_parameter_file_of_the_package_or_another(launch, name, tmp_path):
    assert launch(name).parameters('idem_ros')[0] == str(ROOT / 'config' / 'refine.yaml')
    (tmp_path / 'mine.yaml').write_text('')
    given = launch(name, f'params_file:={tmp_path / "mine.yaml"}')
    assert given.parameters('idem_ros')[0] == str(tmp_path / 'mine.yaml')


@both
@pytest.mark.parametrize('parameter', PARAMETERS)
def test_argument_that_is_named_as_a_parameter_comes_before_the_parameter_file(
    launch, name, parameter
):
    assert parameter in [parameter_name(field) for field in parameter_fields()]
    assert launch(name, f'{parameter}:=given').parameters('idem_ros')[1][parameter] == 'given'


def test_refine_leaves_parameters_to_the_file_where_no_argument_names_them(launch):
    assert launch('refine').parameters('idem_ros')[1] == {'use_sim_time': 'false'}


def test_replay_listens_as_the_player_publishes(launch):
    launched = launch('replay')
    assert launched.parameters('idem_ros')[1] == {
        'use_sim_time': 'true',
        'reliability': 'reliable',
        'target_durability': 'transient_local',
    }
    assert_is_the_profile(launched.of_kind('SetEnvironmentVariable')[0])


@both
@pytest.mark.parametrize(
    ('word', 'meant'),
    [('voxelsize:=0.5', 'voxel_size?'), ('sourcetopic:=/x', 'there is no launch argument')],
)
def test_unknown_argument_is_refused_before_anything_is_started(launch, name, word, meant):
    with pytest.raises(LaunchRefused, match=f'{word}.*') as refused:
        launch(name, word)
    assert meant in str(refused.value)


def test_replay_refuses_an_argument_that_it_fixes(launch):
    with pytest.raises(LaunchRefused, match='use_sim_time:=false'):
        launch('replay', 'use_sim_time:=false')


@both
def test_file_that_includes_ours_may_have_arguments_of_its_own(launch, name):
    launched = launch(name, 'robot:=spot', by='/opt/bringup/robot.launch.py')
    assert launched.node('idem_ros').on_exit is None, 'a robot has more than this node'


@both
def test_parameter_file_that_does_not_exist_is_refused_by_its_name(launch, name):
    with pytest.raises(LaunchRefused, match='params_file:=absent.yaml does not exist'):
        launch(name, 'params_file:=absent.yaml')


@both
def test_parameter_file_that_is_a_folder_is_refused(launch, name):
    with pytest.raises(LaunchRefused, match='is no file'):
        launch(name, f'params_file:={ROOT}')


def test_recording_that_does_not_exist_is_refused_before_anything_is_started(launch):
    with pytest.raises(LaunchRefused, match='bag:=absent.mcap does not exist'):
        launch('replay', 'bag:=absent.mcap')


@both
def test_missing_rviz_is_refused_before_anything_is_started(launch, name, monkeypatch):
    def absent(package):
        raise KeyError(package)

    monkeypatch.setattr(sys.modules['ament_index_python.packages'], 'get_package_prefix', absent)
    with pytest.raises(LaunchRefused, match='rviz2 is not installed: give rviz:=false'):
        launch(name, 'rviz:=true')
    assert launch(name, 'rviz:=false').node('idem_ros')


@both
def test_all_that_was_launched_ends_with_the_node(launch, name):
    assert launch(name).node('idem_ros').on_exit.kind == 'Shutdown'


def test_rviz_is_started_where_it_is_asked_for_with_the_topics_of_the_node(launch):
    launched = launch('refine', 'rviz:=true', 'target:=/map', 'fixed_frame:=odom')
    rviz = launched.node('rviz2')
    words = [launched.value(each) for each in rviz.arguments]
    assert words[-2:] == ['-f', 'odom']
    topics = {
        each['Topic']['Value']
        for each in yaml.safe_load(Path(words[1]).read_text())['Visualization Manager']['Displays']
        if 'Topic' in each
    }
    remapped = launched.remappings('rviz2')
    assert remapped['/target'] == '/map'
    assert set(remapped) <= {*topics, '/source'}
    published = {topic.name.replace('~', '/idem_node') for topic in OUTPUTS.values()}
    assert topics - {'/target'} <= published


def test_rviz_and_the_profile_for_large_clouds_are_off_by_default(launch):
    launched = launch('refine')
    assert [each.package for each in launched.of_kind('Node')] == ['idem_ros']
    assert not launched.of_kind('SetEnvironmentVariable')
    assert_is_the_profile(
        launch('refine', 'large_clouds:=true').of_kind('SetEnvironmentVariable')[0]
    )


def assert_is_the_profile(action):
    name, file = action.positional
    assert loopback_environment()[name] == file


def test_replay_plays_once_when_the_node_says_that_it_is_ready(launch):
    launched = launch('replay', f'bag:={DEMO}', 'rate:=2.0')
    (handler,) = launched.of_kind('RegisterEventHandler')[0].positional
    assert handler.on_stderr(SimpleNamespace(text=b'compiling kernels')) is None
    unregistered, play = handler.on_stderr(SimpleNamespace(text=READY_LINE))
    assert unregistered.positional == (handler,)
    idem, *words = [launched.value(word) for word in play.cmd]
    assert idem == 'idem_ros/idem'
    parsed = command_line().parse_args(words)
    assert (parsed.bag, parsed.rate, parsed.clock) == (str(DEMO), 2.0, True)
    assert play.on_exit(SimpleNamespace(returncode=0), None) is None
    assert play.on_exit(SimpleNamespace(returncode=1), None).kind == 'Shutdown'


def test_what_starts_the_player_is_registered_before_the_node_is_started(launch):
    kinds = [each.kind for each in launch('replay').actions]
    assert kinds.index('RegisterEventHandler') < kinds.index('Node')


def test_line_that_starts_the_player_is_what_the_node_says():
    said = (ROOT / 'idem_ros' / 'node' / 'live_registration.py').read_text()
    assert 'ready: listens to' in said


@pytest.mark.parametrize(
    ('command', 'file'),
    [
        ('ros2 launch idem_ros refine.launch.py rviz:=true', 'refine.launch.py'),
        ('ros2 launch /opt/share/replay.launch.py', 'replay.launch.py'),
        ('ros2 launch mine robot.launch.py', None),
    ],
)
def test_file_that_is_launched_itself_is_told_from_one_that_is_included(command, file):
    assert launched_file(command.split()) == file


def test_an_auditor_listens_to_the_topics_of_its_stack(launch):
    launched = launch('audit', 'stack:=autoware_ndt')
    assert launched.remappings('idem_ros') == {
        '~/target': '/map/pointcloud_map',
        '~/source': '/localization/util/downsample/pointcloud',
        '~/initial_guess': '/localization/pose_estimator/pose_with_covariance',
    }
    file, given = launched.parameters('idem_ros')
    assert file == str(ROOT / 'config' / 'audit_pose_with_covariance.yaml')
    assert given['mode'] == 'audit'


@pytest.mark.parametrize('stack', ['lidar_localization_ros2', 'kiss_icp', 'mola', 'glim'])
def test_every_stack_has_topics_and_a_parameter_file_that_judges(launch, stack):
    launched = launch('audit', f'stack:={stack}')
    file, _ = launched.parameters('idem_ros')
    parameters = parameters_in(Path(file))
    assert parameters['mode'] == 'audit'
    assert all(topic.startswith('/') for topic in launched.remappings('idem_ros').values())
    assert parameters['initial_guess.type'] in Path(file).stem


def test_topics_and_parameters_of_a_stack_can_be_given(launch, tmp_path):
    (tmp_path / 'mine.yaml').write_text('')
    words = 'stack:=kiss_icp', 'source:=/ouster/points', f'params_file:={tmp_path}/mine.yaml'
    launched = launch('audit', *words)
    assert launched.remappings('idem_ros')['~/source'] == '/ouster/points'
    assert launched.parameters('idem_ros')[0] == f'{tmp_path}/mine.yaml'


def test_a_stack_that_there_is_not_is_refused(launch):
    with pytest.raises(LaunchRefused, match='stack:=slam_toolbox; it must be one of autoware_ndt'):
        launch('audit', 'stack:=slam_toolbox')


@pytest.fixture
def rig_words(tmp_path):
    (tmp_path / 'extrinsics.yaml').write_text('sensors: {}')
    return f'extrinsics:={tmp_path}/extrinsics.yaml', "topics:=['/top/points', '/left/points']"


def test_the_node_that_watches_a_rig_is_started_with_its_rig(launch, rig_words, tmp_path):
    launched = launch('rig', *rig_words, 'period:=5.0')
    node = launched.node('idem_ros')
    assert f"'{node.executable} = idem_ros.node" in (ROOT / 'setup.py').read_text()
    (given,) = node.parameters
    values = {name: launched.value(each) for name, each in given.items()}
    assert yaml.safe_load(values['topics']) == ['/top/points', '/left/points']
    assert values == {
        'use_sim_time': 'false',
        'extrinsics': f'{tmp_path}/extrinsics.yaml',
        'topics': values['topics'],
        'period': '5.0',
    }
    assert set(values) - {'use_sim_time'} <= RIG_PARAMETERS
    assert node.on_exit.kind == 'Shutdown'


def test_a_rig_without_its_files_or_with_unknown_words_is_refused(launch, rig_words, tmp_path):
    extrinsics, topics = rig_words
    with pytest.raises(LaunchRefused, match='extrinsics:=absent.yaml does not exist'):
        launch('rig', 'extrinsics:=absent.yaml', topics)
    with pytest.raises(LaunchRefused, match='period'):
        launch('rig', extrinsics, topics, 'periods:=5.0')
    with pytest.raises(LaunchRefused, match='params_file:=absent.yaml does not exist'):
        launch('rig', extrinsics, topics, 'params_file:=absent.yaml')
    file = tmp_path / 'mine.yaml'
    file.write_text('')
    assert launch('rig', extrinsics, topics, f'params_file:={file}').parameters('idem_ros')[0] == (
        str(file)
    )
