"""Start idem_node on a robot's topics: `ros2 launch idem_ros refine.launch.py --show-args`."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchDescription

INPUTS = {
    'target': 'cloud to register to, PointCloud2: a map or the scan before',
    'source': 'cloud to register, PointCloud2',
    'initial_guess': 'pose of the source frame in the target frame, TransformStamped',
}


def generate_launch_description():
    """Return the node, its inputs remapped by arguments, its parameters from a file."""
    params_file = Path(get_package_share_directory('idem_ros')) / 'config' / 'refine.yaml'
    arguments = [
        DeclareLaunchArgument(name, default_value=f'/{name}', description=f'topic of the {what}')
        for name, what in INPUTS.items()
    ]
    arguments += [
        DeclareLaunchArgument(
            'params_file', default_value=str(params_file), description='parameters of the node'
        ),
        DeclareLaunchArgument(
            'use_sim_time', default_value='false', description='true: time is that of /clock'
        ),
    ]
    node = Node(
        package='idem_ros',
        executable='idem_node',
        name='idem_node',
        output='screen',
        parameters=[
            LaunchConfiguration('params_file'),
            {'use_sim_time': LaunchConfiguration('use_sim_time')},
        ],
        remappings=[(f'~/{name}', LaunchConfiguration(name)) for name in INPUTS],
    )
    return LaunchDescription([*arguments, node])
