"""The node starts without a home, and ends while it compiles."""

import signal
import subprocess
import tempfile

import pytest
from live import LONG, own_environment, rclpy, wait_for_line  # noqa: F401  (the node needs it)

# isort: split
from benchmarks.soak.children import started
from idem_ros.node.environment import WITHOUT_FILE, logging_arguments
from idem_ros.node.ports import FIRST_PORT, PORTS, SHARED_MEMORY
from idem_ros.node.process import NODE

PIPED = {'stderr': subprocess.PIPE, 'text': True}


@pytest.fixture
def no_home(tmp_path, monkeypatch):
    """An environment in which ROS finds no folder for its log files."""
    for name in ('ROS_LOG_DIR', 'ROS_HOME'):
        monkeypatch.delenv(name, raising=False)
    (tmp_path / 'file').write_text('')
    (tmp_path / 'tmp').mkdir()
    monkeypatch.setenv('HOME', str(tmp_path / 'file'))
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path / 'tmp'))
    return monkeypatch


def segments_of(environment):
    """Return the segments of shared memory behind the ports of an environment's domain."""
    first = FIRST_PORT + PORTS * int(environment['ROS_DOMAIN_ID'])
    segments = (SHARED_MEMORY / f'fastrtps_port{first + i}' for i in range(PORTS))
    return {each for each in segments if each.exists()}


@pytest.mark.parametrize('signum', [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_a_node_that_compiles_without_waiting_for_it(signum, tmp_path):
    environment = {**own_environment(), 'NUMBA_CACHE_DIR': str(tmp_path)}
    before = segments_of(environment)  # a process that was killed there may have left some
    with started(NODE, env=environment, **PIPED) as node:
        wait_for_line(node.stderr, 'compiling kernels')
        node.send_signal(signum)
        _, errors = node.communicate(timeout=LONG)
    assert (node.returncode, errors) == (0, '')
    assert not segments_of(environment) - before, 'the node left its shared memory behind'


def test_node_whose_home_is_no_folder_is_ready_and_says_where_its_log_is(tmp_path):
    (tmp_path / 'file').write_text('')
    environment = {**own_environment(), 'TMPDIR': str(tmp_path), 'HOME': str(tmp_path / 'file')}
    environment |= {'ROS_LOG_DIR': '', 'ROS_HOME': ''}
    with started(NODE, env=environment, **PIPED) as node:
        line = node.stderr.readline()
        wait_for_line(node.stderr, 'ready')
    (folder,) = tmp_path.glob('idem_ros_log_*')
    assert line.startswith(f'log files go to {folder} (')
    assert list(folder.iterdir())


@pytest.mark.parametrize('home', [None, ''])
def test_without_a_home_log_files_go_among_the_temporary_ones(no_home, tmp_path, caplog, home):
    no_home.setenv('ROS_LOG_DIR', '')
    no_home.setenv('HOME', home or '')
    if home is None:
        no_home.delenv('HOME')
    assert logging_arguments() == []
    assert f'log files go to {tmp_path / "tmp"}' in caplog.text


def test_environment_that_names_a_folder_for_log_files_is_left_alone(no_home, tmp_path, caplog):
    no_home.setenv('ROS_LOG_DIR', str(tmp_path / 'log'))
    assert logging_arguments() == []
    assert not caplog.records


def test_without_any_folder_no_log_file_is_written_and_a_line_says_so(no_home, tmp_path, caplog):
    no_home.setattr(tempfile, 'tempdir', str(tmp_path / 'file'))
    assert logging_arguments() == WITHOUT_FILE
    assert 'ROS_LOG_DIR names a folder' in caplog.text
    rclpy_context = rclpy.Context()
    rclpy.init(args=WITHOUT_FILE, context=rclpy_context)
    rclpy_context.try_shutdown()


def test_unwritable_folder_of_the_environment_is_not_insisted_on(no_home, tmp_path, caplog):
    no_home.setenv('ROS_LOG_DIR', str(tmp_path / 'file' / 'log'))
    assert logging_arguments() == []
    assert 'log files go to' in caplog.text
