"""Refine a recording live: `ros2 launch idem_ros replay.launch.py bag:=bags/demo.mcap`.

Starts idem_node and RViz, and, once the node listens, `idem play`.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    RegisterEventHandler,
    SetEnvironmentVariable,
    UnregisterEventHandler,
)
from launch.conditions import IfCondition
from launch.event_handlers import OnProcessIO
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.substitutions import ExecutableInPackage

from launch import LaunchDescription

INPUTS = ('target', 'source', 'initial_guess')
READY = b'ready: listens to'
LATCHED = 'transient_local where the recording has one target or its topic is named target'


def generate_launch_description():
    """Return the node with the quality of service of the player, RViz, and what starts to play."""
    config = Path(get_package_share_directory('idem_ros')) / 'config'
    arguments = {
        'bag': (None, 'recording: .mcap, rosbag2 folder, .db3 or ROS 1 .bag'),
        'rate': ('1.0', 'times the recorded pace'),
        **{name: (f'/{name}', 'its topic in the recording') for name in INPUTS},
        'params_file': (str(config / 'refine.yaml'), 'parameters of the node'),
        'target_durability': ('transient_local', f'{LATCHED}; else volatile'),
        'rviz': ('true', 'false: without RViz'),
        'fixed_frame': ('map', 'frame of the target, which RViz shows'),
    }
    use_sim_time = {'use_sim_time': True}
    durability = LaunchConfiguration('target_durability')
    as_played = {'reliability': 'reliable', 'target_durability': durability}
    node = Node(
        package='idem_ros',
        executable='idem_node',
        name='idem_node',
        output='screen',
        parameters=[LaunchConfiguration('params_file'), use_sim_time, as_played],
        remappings=[(f'~/{name}', LaunchConfiguration(name)) for name in INPUTS],
    )
    rviz = Node(
        package='rviz2',
        executable='rviz2',
        arguments=['-d', str(config / 'idem.rviz'), '-f', LaunchConfiguration('fixed_frame')],
        parameters=[use_sim_time],
        remappings=[(f'/{name}', LaunchConfiguration(name)) for name in ('target', 'source')],
        condition=IfCondition(LaunchConfiguration('rviz')),
    )
    profile = SetEnvironmentVariable(
        'FASTRTPS_DEFAULT_PROFILES_FILE', str(config / 'fastdds_large_clouds.xml')
    )
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=what)
        for name, (default, what) in arguments.items()
    ]
    return LaunchDescription([*declared, profile, _played_when_ready(node), node, rviz])


def _played_when_ready(node):
    """Return what starts the player when the node says that it listens: compiling takes long."""
    idem = ExecutableInPackage('idem', 'idem_ros')
    bag, rate = LaunchConfiguration('bag'), LaunchConfiguration('rate')
    play = ExecuteProcess(cmd=[idem, 'play', bag, '--rate', rate, '--clock'], output='screen')

    def on_output(event):
        return [UnregisterEventHandler(handler), play] if READY in event.text else None

    handler = OnProcessIO(target_action=node, on_stdout=on_output, on_stderr=on_output)
    return RegisterEventHandler(handler)
