"""Launch and tf by the packages of an installed ROS 2: `make test-ros`; elsewhere skipped."""

import os
import re
import shutil
import signal
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from conftest import ROOT
from live import LONG, own_environment, rclpy  # noqa: F401  (the live side)
from node_bench import FIRST, T_TRUTH, guess_message, send

# isort: split
import numpy as np
from rclpy.qos import DurabilityPolicy, QoSProfile

from idem_ros.messages.transform_message import matrix_of

INSTALLED = 'an installed Jazzy, sourced: see docs/ros_tests.md'
with_launch = pytest.mark.skipif(
    shutil.which('ros2') is None, reason=f'needs the command ros2 of {INSTALLED}'
)
with_tf = pytest.mark.skipif(
    find_spec('tf2_msgs') is None, reason=f'needs the package tf2_msgs of {INSTALLED}'
)
DEMO = ROOT / 'bags' / 'demo.mcap'
SCRIPT = '#!{python}\nimport sys\nfrom {module} import {function}\nsys.exit({function}())\n'
SCRIPTS = {
    'idem_node': ('idem_ros.node.entry', 'main'),
    'idem': ('idem_ros.commands.main', 'main'),
}


@pytest.fixture
def environment(tmp_path):
    """The environment of `ros2` in which this checkout is an installed package."""
    share = tmp_path / 'share' / 'idem_ros'
    index = tmp_path / 'share' / 'ament_index' / 'resource_index' / 'packages'
    executables = tmp_path / 'lib' / 'idem_ros'
    for folder in (share, index, executables):
        folder.mkdir(parents=True)
    (index / 'idem_ros').touch()
    for name in ('launch', 'config', 'package.xml'):
        (share / name).symlink_to(ROOT / name)
    for name, (module, function) in SCRIPTS.items():
        script = executables / name
        script.write_text(SCRIPT.format(python=sys.executable, module=module, function=function))
        script.chmod(0o755)
    return {
        **own_environment(),
        'AMENT_PREFIX_PATH': f'{tmp_path}:{os.environ.get("AMENT_PREFIX_PATH", "")}',
        'PYTHONPATH': f'{ROOT}:{os.environ.get("PYTHONPATH", "")}',
        'PYTHONUNBUFFERED': '1',
    }


@pytest.fixture
def launch(environment):
    """Start `ros2 launch` of a file of the package; it is ended with the test."""
    processes = []

    def start(name, *words):
        process = subprocess.Popen(
            ['ros2', 'launch', 'idem_ros', f'{name}.launch.py', *words],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        processes.append(process)
        return process

    yield start
    for process in processes:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=LONG)


def said_until(process, text):
    """Return what a process printed up to the line that holds a text."""
    lines = []
    for line in process.stdout:
        lines.append(line)
        if text in line:
            return ''.join(lines)
    raise AssertionError(f'it ended without saying {text!r}: {"".join(lines)}')


def started_by(printed):
    """Return the ids of the processes that launch says it has started."""
    return [int(pid) for pid in re.findall(r'process started with pid \[(\d+)\]', printed)]


@with_launch
def test_replay_refines_the_demo_and_ends_on_sigint(launch):
    process = launch('replay', f'bag:={DEMO}', 'rviz:=false', 'voxel_size:=0.5')
    printed = said_until(process, 'process has finished cleanly')  # of the player
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=LONG)
    assert 'refused' in rest
    answered = int(re.search(r'(\d+) answered', rest)[1])
    assert answered > 15
    assert not any(Path(f'/proc/{pid}').exists() for pid in started_by(printed + rest))


@with_launch
@pytest.mark.parametrize(
    ('name', 'words', 'reason'),
    [
        ('refine', ['voxelsize:=0.5'], 'there is no launch argument voxelsize; voxel_size?'),
        ('refine', ['params_file:=absent.yaml'], 'params_file:=absent.yaml does not exist'),
        ('replay', ['bag:=absent.mcap', 'rviz:=false'], 'bag:=absent.mcap does not exist'),
        ('replay', [f'bag:={DEMO}', 'raet:=2'], 'there is no launch argument raet; rate?'),
    ],
)
def test_unusable_argument_ends_launch_with_one_line_and_starts_nothing(
    launch, name, words, reason
):
    process = launch(name, *words)
    printed, _ = process.communicate(timeout=LONG)
    assert process.returncode != 0
    assert reason in printed
    assert not started_by(printed)


@with_launch
@pytest.mark.skipif(shutil.which('rviz2') is not None, reason='rviz2 is installed here')
def test_without_rviz_replay_names_the_remedy_and_starts_nothing(launch):
    printed, _ = launch('replay', f'bag:={DEMO}').communicate(timeout=LONG)
    assert 'rviz:=false' in printed
    assert not started_by(printed)


@with_launch
def test_launch_ends_with_a_node_that_cannot_start(launch):
    printed, _ = launch('refine', 'voxel_size:=-1.0').communicate(timeout=LONG)
    assert 'voxel_size' in printed
    assert 'idem_node has ended' in printed or 'process has died' in printed


@with_launch
@pytest.mark.parametrize('name', ['refine', 'replay'])
def test_arguments_are_shown(environment, name):
    command = ['ros2', 'launch', 'idem_ros', f'{name}.launch.py', '--show-args']
    shown = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=LONG, check=True
    ).stdout
    for argument in ('voxel_size', 'mode', 'reliability', 'target_durability', 'params_file'):
        assert f"'{argument}'" in shown


@with_launch
def test_another_launch_file_may_include_ours_with_arguments_of_its_own(environment, tmp_path):
    file = tmp_path / 'robot.launch.py'
    file.write_text(INCLUDES)
    command = ['ros2', 'launch', str(file), 'robot:=spot']
    process = subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    said_until(process, 'ready: listens to')
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=LONG)


INCLUDES = """
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource

def generate_launch_description():
    file = get_package_share_directory('idem_ros') + '/launch/refine.launch.py'
    return LaunchDescription([
        DeclareLaunchArgument('robot'),
        IncludeLaunchDescription(PythonLaunchDescriptionSource(file)),
    ])
"""


@with_tf
def test_guess_comes_from_tf(bench, clouds):
    from tf2_msgs.msg import TFMessage

    b = bench(guess_type='tf', guess_class=None).start()
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    fixed = b.other.create_publisher(TFMessage, '/tf_static', latched)
    moving = b.other.create_publisher(TFMessage, '/tf', 100)
    b.until(lambda: fixed.get_subscription_count() and moving.get_subscription_count())
    fixed.publish(TFMessage(transforms=[guess_message(np.eye(4), 0, 'base', 'lidar')]))
    send(b, clouds, FIRST)
    for shift in (-(10**7), 10**7):
        transform = guess_message(np.eye(4), FIRST + shift, 'map', 'base')
        moving.publish(TFMessage(transforms=[transform]))
    np.testing.assert_allclose(matrix_of(b.transform_of(FIRST)), T_TRUTH, rtol=0, atol=0.02)


@with_tf
def test_results_that_are_aligned_go_out_on_tf(bench, clouds):
    from tf2_msgs.msg import TFMessage

    b, heard = bench(publish_tf=True), []
    b.other.create_subscription(TFMessage, '/tf', heard.append, 10)
    b.start()
    b.until(lambda: b.other.count_publishers('/tf'))
    send(b, clouds, FIRST)
    transform = b.transform_of(FIRST)
    b.until(lambda: heard)
    assert heard[0].transforms == [transform]
