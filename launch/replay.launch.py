"""Refine a recording live: `ros2 launch idem_ros replay.launch.py bag:=bags/demo.mcap`.

Starts what refine.launch.py starts, with the quality of service of the player, and, once the
node listens, `idem play`.
"""

from pathlib import Path

from launch.actions import (
    ExecuteProcess,
    IncludeLaunchDescription,
    OpaqueFunction,
    RegisterEventHandler,
    Shutdown,
    UnregisterEventHandler,
)
from launch.event_handlers import OnProcessIO
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.substitutions import ExecutableInPackage

from idem_ros.parameters.launch_arguments import (
    declared,
    launched_file,
    require_file,
    require_known,
)
from launch import LaunchDescription

REFINE = PythonLaunchDescriptionSource(str(Path(__file__).with_name('refine.launch.py')))
READY = b'ready: listens to'
FIXED = {'use_sim_time': 'true', 'large_clouds': 'true'}
ARGUMENTS = {
    'bag': (None, 'recording: .mcap, rosbag2 folder, .db3 or ROS 1 .bag'),
    'rate': ('1.0', 'times the recorded pace'),
    'reliability': ('reliable', 'as the player publishes'),
    'target_durability': (
        'transient_local',
        'as the player publishes where the recording has one target or its topic is named '
        'target; else volatile',
    ),
    'rviz': ('true', 'false: without RViz'),
}


def generate_launch_description():
    """Return the node with the quality of service of the player, RViz, and what starts to play."""
    included = IncludeLaunchDescription(REFINE, launch_arguments=FIXED.items())
    return LaunchDescription(
        [*declared(ARGUMENTS), OpaqueFunction(function=_check), _played_when_ready(), included]
    )


def _check(context):
    if launched_file() == 'replay.launch.py':
        passed_on = REFINE.get_launch_description(context).get_launch_arguments()
        known = {*ARGUMENTS, *(each.name for each in passed_on)}
        require_known(context.argv, known - set(FIXED))
    require_file('bag', LaunchConfiguration('bag').perform(context))


def _played_when_ready():
    """Return what starts the player when the node says that it listens: compiling takes long."""
    idem = ExecutableInPackage('idem', 'idem_ros')
    bag, rate = LaunchConfiguration('bag'), LaunchConfiguration('rate')
    play = ExecuteProcess(
        cmd=[idem, 'play', bag, '--rate', rate, '--clock'], output='screen', on_exit=_ended
    )

    def on_output(event):
        return [UnregisterEventHandler(handler), play] if READY in event.text else None

    handler = OnProcessIO(on_stdout=on_output, on_stderr=on_output)
    return RegisterEventHandler(handler)


def _ended(event, context):
    """End the node and RViz where the player failed; else there is something to look at."""
    return Shutdown(reason='nothing could be played') if event.returncode else None
