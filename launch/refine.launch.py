"""Start idem_node on a robot's topics: `ros2 launch idem_ros refine.launch.py --show-args`."""

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
    require_rviz,
)
from launch import LaunchDescription

CONFIG = Path(get_package_share_directory('idem_ros')) / 'config'
INPUTS = {
    'target': 'topic of the cloud to register to, PointCloud2: a map or the scan before',
    'source': 'topic of the cloud to register, PointCloud2',
    'initial_guess': 'topic of the pose of the source frame in the target frame, of the type that '
    'the parameter initial_guess.type says',
}
PARAMETERS = {
    'voxel_size': '[m] edge of the voxels that both clouds are reduced to: 0.5 outdoors, 0.1 in '
    'rooms; 0.0: none',
    'mode': 'refine, or audit: nothing moves, the guess is judged',
    'reliability': 'of all inputs: best_effort, or reliable',
    'target_durability': 'of the target: volatile, or transient_local for a map published once',
    'target_file': 'a map on disk in place of a topic: a cloud, or a folder of tiles',
    'target_frame': 'frame of the map in target_file',
}
OTHERS = {
    'params_file': (
        str(CONFIG / 'refine.yaml'),
        'parameters of the node; for a kind of sensor see depth_camera.yaml, lidar_16.yaml '
        'and lidar_64.yaml beside it',
    ),
    **COMMON,
    'rviz': ('false', 'true: show target, refined source and pose'),
    'find': (
        'false',
        'true: refine nothing; list the clouds, poses and tf on the graph, propose a command line',
    ),
    'fixed_frame': ('map', 'frame of the target, which RViz shows'),
}
ARGUMENTS = {
    **{name: (f'/{name}', what) for name, what in INPUTS.items()},
    **left_to_file(PARAMETERS),
    **OTHERS,
}


def generate_launch_description():
    """Return the node, its inputs remapped by arguments, its parameters from a file; RViz."""
    # checked first: launch forgets a process whose start is followed by an error
    return LaunchDescription(
        [*declared(ARGUMENTS), OpaqueFunction(function=_check), OpaqueFunction(function=_start)]
    )


def _check(context):
    if launched_file() == 'refine.launch.py':
        require_known(context.argv, ARGUMENTS)
    require_file('params_file', LaunchConfiguration('params_file').perform(context))
    if IfCondition(LaunchConfiguration('rviz')).evaluate(context):
        require_rviz()


def _start(context):
    use_sim_time = {'use_sim_time': LaunchConfiguration('use_sim_time')}
    given = {
        name: LaunchConfiguration(name)
        for name in PARAMETERS
        if LaunchConfiguration(name).perform(context)
    }
    finds = IfCondition(LaunchConfiguration('find')).evaluate(context)
    node = Node(
        package='idem_ros',
        executable='idem_node',
        arguments=['--find'] if finds else [],
        name='idem_node',
        output='screen',
        parameters=[LaunchConfiguration('params_file'), use_sim_time, given],
        remappings=[(f'~/{name}', LaunchConfiguration(name)) for name in INPUTS],
        # not where somebody else's launch file includes this one: a robot has more than this node
        on_exit=Shutdown(reason='idem_node has ended') if launched_file() else None,
    )
    rviz = Node(
        package='rviz2',
        executable='rviz2',
        arguments=['-d', str(CONFIG / 'idem.rviz'), '-f', LaunchConfiguration('fixed_frame')],
        parameters=[use_sim_time],
        remappings=[(f'/{name}', LaunchConfiguration(name)) for name in ('target', 'source')],
        condition=IfCondition(LaunchConfiguration('rviz')),
    )
    profile = SetEnvironmentVariable(
        'FASTRTPS_DEFAULT_PROFILES_FILE',
        str(CONFIG / 'fastdds_large_clouds.xml'),
        condition=IfCondition(LaunchConfiguration('large_clouds')),
    )
    return [profile, node, rviz]
