"""Watch the LiDARs of a rig: `ros2 launch idem_ros rig.launch.py --show-args`."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import (
    OpaqueFunction,
    SetEnvironmentVariable,
    Shutdown,
)
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from idem_ros.parameters.launch_arguments import (
    COMMON,
    declared,
    launched_file,
    left_to_file,
    require_file,
    require_known,
)
from launch import LaunchDescription

CONFIG = Path(get_package_share_directory('idem_ros')) / 'config'
RIG = {
    'extrinsics': 'where the sensors should be: extrinsics.yaml of idem calibrate --out, another '
    'YAML, or a URDF',
    'topics': 'PointCloud2 of each sensor, the reference of the extrinsics first: '
    "\"['/top/points', '/left/points']\"",
}
PARAMETERS = {
    'period': '[s] from one instant that is looked at to the next',
    'instants': 'how many of the last instants are made one',
    'voxel_size': '[m] edge of the voxels: 0.5 outdoors, 0.1 in rooms',
    'reliability': 'of the subscriptions: best_effort, or reliable',
}
OTHERS = {
    'params_file': ('', 'parameters of the node; empty: its own'),
    **COMMON,
}
ARGUMENTS = {
    **{name: (None, what) for name, what in RIG.items()},
    **left_to_file(PARAMETERS),
    **OTHERS,
}


def generate_launch_description():
    """Return the node that watches a rig, its parameters from arguments and a file."""
    return LaunchDescription(
        [*declared(ARGUMENTS), OpaqueFunction(function=_check), OpaqueFunction(function=_start)]
    )


def _check(context):
    if launched_file() == 'rig.launch.py':
        require_known(context.argv, ARGUMENTS)
    require_file('extrinsics', LaunchConfiguration('extrinsics').perform(context))
    if params_file := LaunchConfiguration('params_file').perform(context):
        require_file('params_file', params_file)


def _start(context):
    names = [*RIG, *(name for name in PARAMETERS if LaunchConfiguration(name).perform(context))]
    given = {name: LaunchConfiguration(name) for name in ('use_sim_time', *names)}
    has_file = bool(LaunchConfiguration('params_file').perform(context))
    node = Node(
        package='idem_ros',
        executable='idem_rig_node',
        name='idem_rig_node',
        output='screen',
        parameters=[*([LaunchConfiguration('params_file')] if has_file else []), given],
        on_exit=Shutdown(reason='idem_rig_node has ended') if launched_file() else None,
    )
    profile = SetEnvironmentVariable(
        'FASTRTPS_DEFAULT_PROFILES_FILE',
        str(CONFIG / 'fastdds_large_clouds.xml'),
        condition=IfCondition(LaunchConfiguration('large_clouds')),
    )
    return [profile, node]
