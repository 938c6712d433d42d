"""Judge another localiser: `ros2 launch idem_ros audit.launch.py stack:=autoware_ndt`.

Starts what refine.launch.py starts, with mode audit, on the topics that the stack publishes; any
of its arguments may be given, too.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

from idem_ros.parameters.launch_arguments import launched_file, require_known, require_one_of
from launch import LaunchDescription

REFINE = PythonLaunchDescriptionSource(str(Path(__file__).with_name('refine.launch.py')))
CONFIG = Path(get_package_share_directory('idem_ros')) / 'config'
NONE = '/initial_guess'  # where the poses come on tf
# target, source, pose, and how the pose comes: as each names them in its own launch files
STACKS = {
    'autoware_ndt': (
        '/map/pointcloud_map',
        '/localization/util/downsample/pointcloud',
        '/localization/pose_estimator/pose_with_covariance',
        'pose_with_covariance',
    ),
    'lidar_localization_ros2': ('/initial_map', '/velodyne_points', NONE, 'tf'),
    'kiss_icp': ('/kiss/local_map', '/points', '/kiss/odometry', 'odometry'),
    'mola': ('/lidar_odometry/localmap_points', '/points', NONE, 'tf'),
    'glim': ('/glim_ros/map', '/glim_ros/points', NONE, 'tf'),
}
TOPICS = 'target', 'source', 'initial_guess'


def generate_launch_description():
    """Return the node as an auditor of the stack that is named."""
    stack = DeclareLaunchArgument('stack', description=f'one of {", ".join(STACKS)}')
    topics = [
        DeclareLaunchArgument(name, default_value='', description="empty: the stack's own")
        for name in TOPICS
    ]
    return LaunchDescription([stack, *topics, OpaqueFunction(function=_included)])


def _included(context):
    stack = LaunchConfiguration('stack').perform(context)
    require_one_of('stack', stack, STACKS)
    *names, kind = STACKS[stack]
    if launched_file() == 'audit.launch.py':
        passed_on = REFINE.get_launch_description(context).get_launch_arguments()
        require_known(context.argv, {'stack', *(each.name for each in passed_on)} - {'mode'})
    given = {name: LaunchConfiguration(name).perform(context) for name in TOPICS}
    topics = {name: given[name] or own for name, own in zip(TOPICS, names, strict=True)}
    arguments = {**topics, 'mode': 'audit'}
    if not any(word.startswith('params_file:=') for word in context.argv):
        arguments['params_file'] = str(CONFIG / f'audit_{kind}.yaml')
    return [IncludeLaunchDescription(REFINE, launch_arguments=arguments.items())]
