"""Start idem_node on a robot's topics: `ros2 launch idem_ros refine.launch.py --show-args`."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchDescription

INPUTS = {
    'target': 'topic of the cloud to register to, PointCloud2: a map or the scan before',
    'source': 'topic of the cloud to register, PointCloud2',
    'initial_guess': 'topic of the pose of the source frame in the target frame, of the type that '
    'the parameter initial_guess.type says',
}
OTHERS = {
    'use_sim_time': ('false', 'true: time is that of /clock'),
    'large_clouds': (
        'false',
        'true: Fast DDS with shared memory for clouds of megabytes, on this machine only; the '
        'publishers must use config/fastdds_large_clouds.xml, too',
    ),
    'rviz': ('false', 'true: show target, refined source and pose'),
    'fixed_frame': ('map', 'frame of the target, which RViz shows'),
}


def generate_launch_description():
    """Return the node, its inputs remapped by arguments, its parameters from a file; RViz."""
    config = Path(get_package_share_directory('idem_ros')) / 'config'
    arguments = {
        **{name: (f'/{name}', what) for name, what in INPUTS.items()},
        'params_file': (
            str(config / 'refine.yaml'),
            'parameters of the node; for a kind of sensor see depth_camera.yaml, lidar_16.yaml '
            'and lidar_64.yaml beside it',
        ),
        **OTHERS,
    }
    use_sim_time = {'use_sim_time': LaunchConfiguration('use_sim_time')}
    node = Node(
        package='idem_ros',
        executable='idem_node',
        name='idem_node',
        output='screen',
        parameters=[LaunchConfiguration('params_file'), use_sim_time],
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
        'FASTRTPS_DEFAULT_PROFILES_FILE',
        str(config / 'fastdds_large_clouds.xml'),
        condition=IfCondition(LaunchConfiguration('large_clouds')),
    )
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=what)
        for name, (default, what) in arguments.items()
    ]
    return LaunchDescription([*declared, profile, node, rviz])
