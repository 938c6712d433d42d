import subprocess
import sys

import pytest

CORE_ONLY = {'rclpy', 'rosbags', 'mcap', 'matplotlib', 'plyfile', 'pypcd4', 'tqdm'}
NO_ROS = {'rclpy', 'sensor_msgs', 'geometry_msgs', 'std_msgs', 'diagnostic_msgs'}


def imported_by(module):
    code = f'import sys, {module}; print(*sys.modules)'
    run = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    return set(run.stdout.split())


@pytest.mark.parametrize(
    ('module', 'banned'),
    [
        ('idem_ros.core', CORE_ONLY),
        ('idem_ros.pointcloud2', CORE_ONLY),
        ('idem_ros.guesses', CORE_ONLY),
        ('idem_ros.transform_tree', CORE_ONLY),
        ('idem_ros.pairing', CORE_ONLY),
        ('idem_ros.preprocessing', CORE_ONLY),
        ('idem_ros.refinement', CORE_ONLY),
        ('idem_ros.files.cloud_file', CORE_ONLY | {'pandas', 'lzf', 'laspy', 'pye57'}),
        ('idem_ros.recording', NO_ROS),
        ('idem_ros.evaluation.replay', NO_ROS),
        ('idem_ros.commands.main', NO_ROS | {'numba', 'rosbags'}),
    ],
)
def test_a_room_imports_only_what_it_may(module, banned):
    assert not banned & imported_by(module)
