"""What was installed works without the checkout: `make wheel` and `make colcon` run this.

It is no test_*.py: `make test` installs nothing. IDEM_EXECUTABLES names the folder of `idem` and
`idem_node`, IDEM_SHARE that of `package.xml`; python is the one they were installed for.
"""

import os
import signal
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from conftest import ROOT
from live import LONG, own_environment, wait_for_line

EXECUTABLES, SHARE = (
    Path(os.environ.get(name, 'absent')).resolve() for name in ('IDEM_EXECUTABLES', 'IDEM_SHARE')
)
SHIPPED = sorted(
    str(file.relative_to(ROOT))
    for folder in ('config', 'launch')
    for file in ROOT.glob(f'{folder}/*.*')
)


def run(*command, cwd):
    """Run a command where no checkout is near, and return what it printed."""
    environment = own_environment()
    done = subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=LONG
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_idem_replays_the_demo(tmp_path):
    bag = str(ROOT / 'bags' / 'demo.mcap')
    idem = str(EXECUTABLES / 'idem')
    assert run(idem, '--version', cwd=tmp_path).startswith('idem ')
    printed = run(idem, 'replay', bag, '--voxel-size', '0.5', cwd=tmp_path)
    assert '21 ' in printed


def test_idem_node_starts_with_each_file_of_the_package_and_ends(tmp_path):
    for file in sorted((SHARE / 'config').glob('*.yaml')):
        command = [str(EXECUTABLES / 'idem_node'), '--ros-args', '--params-file', str(file)]
        with subprocess.Popen(
            command, cwd=tmp_path, env=own_environment(), stderr=subprocess.PIPE, text=True
        ) as node:
            if file.name == 'audit_tf.yaml' and find_spec('tf2_msgs') is None:
                wait_for_line(node.stderr, 'needs the ROS package tf2_msgs')
                continue
            wait_for_line(node.stderr, 'ready')
            node.send_signal(signal.SIGTERM)
            assert node.wait(LONG) == 0


@pytest.mark.parametrize('file', SHIPPED)
def test_each_launch_and_config_file_is_found_beside_the_installed_code(file, tmp_path):
    asks = 'from idem_ros.files.installed_file import installed_file'
    code = f'{asks}; print(installed_file({file!r}))'
    assert Path(run(sys.executable, '-c', code, cwd=tmp_path).strip()) == SHARE / file
    assert (SHARE / file).read_bytes() == (ROOT / file).read_bytes()


def test_every_file_beside_the_code_is_installed_with_it(tmp_path):
    code = 'import idem_ros; print(idem_ros.__path__[0])'
    installed = Path(run(sys.executable, '-c', code, cwd=tmp_path).strip())
    assert installed != ROOT / 'idem_ros'
    assert files_of(installed) == files_of(ROOT / 'idem_ros')


def test_benchmarks_and_tests_are_not_installed(tmp_path):
    code = """if True:
        from importlib.metadata import files
        print(*{file.parts[0] for file in files('idem_ros')})
        from importlib.util import find_spec
        print(*filter(find_spec, ('benchmarks', 'fuzz')))
    """
    tops, found = run(sys.executable, '-c', code, cwd=tmp_path).split('\n')[:2]
    assert 'idem_ros' in tops.split()
    assert not {'benchmarks', 'test', 'fuzz'} & set(tops.split())
    assert not found


def files_of(package):
    return {
        str(file.relative_to(package))
        for file in package.rglob('*.*')
        if file.is_file() and '__pycache__' not in file.parts
    }


def test_ament_finds_the_package(tmp_path, monkeypatch):
    from ament_index_python.packages import get_package_share_directory

    monkeypatch.setenv('AMENT_PREFIX_PATH', str(SHARE.parent.parent))
    assert Path(get_package_share_directory('idem_ros')) == SHARE


def test_type_checkers_find_the_types_of_what_is_installed(tmp_path):
    code = 'import idem_ros, pathlib; print(pathlib.Path(idem_ros.__file__).parent / "py.typed")'
    assert Path(run(sys.executable, '-c', code, cwd=tmp_path).strip()).is_file()
