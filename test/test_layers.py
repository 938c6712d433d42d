import ast
import subprocess
import sys
from pathlib import Path

import pytest

import idem_ros.core

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


def test_the_core_shows_its_names_before_they_are_loaded():
    code = (
        'import idem_ros.core as core, sys; print(*dir(core)); assert "numba" not in sys.modules'
    )
    run = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert set(idem_ros.core.__all__) <= set(run.stdout.split())


def test_type_checkers_are_told_of_each_name_where_it_is():
    tree = ast.parse(Path(idem_ros.core.__file__).read_text())
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    told = {name.name: each.module for each in block.body for name in each.names}
    loaded = {name: f'idem_ros.core.{room}' for name, room in idem_ros.core._LOADED_LATER.items()}
    assert told == loaded
