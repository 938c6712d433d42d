"""The node as its own process: how it starts and how it ends."""

import signal
import subprocess
import sys

import pytest
from conftest import ROOT
from live import LONG, own_environment, wait_for_line

# isort: split
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from idem_ros.node import entry
from idem_ros.node.environment import loopback_environment
from idem_ros.node.ignored_arguments import warn_of_ignored

COMMAND = [sys.executable, '-m', 'idem_ros.node.entry']

MANAGED = [
    *(sys.executable, '-c'),
    'import sys; from idem_ros.node import entry; sys.exit(entry.main_managed())',
]


@pytest.fixture
def start():
    processes = []

    def start(*arguments, command=COMMAND):
        process = subprocess.Popen(
            [*command, *arguments], env=own_environment(), stderr=subprocess.PIPE, text=True
        )
        processes.append(process)
        return process

    yield start
    for process in processes:
        process.terminate()
        process.wait()
        process.stderr.close()


@pytest.fixture
def run_here(monkeypatch, capsys):
    """Runs a node that refuses to start, in this process; returns its exit code and stderr."""
    for name, value in loopback_environment().items():
        monkeypatch.setenv(name, value)
    handlers = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)}

    def run_here(*arguments, main=entry.main):
        try:
            code = main(['idem_node', *arguments])
        except SystemExit as ended:  # of what argparse refuses
            code = ended.code
        return code, capsys.readouterr().err

    yield run_here
    for signum, handler in handlers.items():
        signal.signal(signum, handler)


@pytest.mark.parametrize('signum', [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_the_node_with_exit_code_0_and_no_traceback(start, signum):
    node = start()
    wait_for_line(node.stderr, 'ready')
    node.send_signal(signum)
    _, errors = node.communicate(timeout=LONG)
    (line,) = errors.splitlines()
    assert node.returncode == 0
    assert line.endswith('of 0 sources 0 answered; 0 refused, 0 dropped')


@pytest.mark.parametrize('signum', [signal.SIGINT, signal.SIGTERM])
def test_signal_during_start_up_ends_the_node_with_exit_code_0(start, signum):
    # the interpreter reports each import as it is done: after this one, main() is under way
    node = start(command=[sys.executable, '-X', 'importtime', *COMMAND[1:]])
    wait_for_line(node.stderr, ' rclpy.')
    node.send_signal(signum)
    _, errors = node.communicate(timeout=LONG)
    assert node.returncode == 0
    assert 'Traceback' not in errors


def test_managed_node_waits_for_its_manager_and_ends_with_exit_code_0(start):
    node = start(command=MANAGED)
    wait_for_line(node.stderr, 'unconfigured: waits for a lifecycle manager')
    node.send_signal(signal.SIGTERM)
    _, errors = node.communicate(timeout=LONG)
    assert (node.returncode, errors) == (0, '')


def test_managed_node_with_an_unusable_parameter_ends_with_exit_code_2_and_one_line(run_here):
    arguments = '--ros-args', '-p', 'a:=-1.0'
    code, errors = run_here(*arguments, main=entry.main_managed)
    assert code == 2
    assert 'idem_lifecycle_node: error: a is -1.0; it must be a number from 0.1 to 50' in errors


def test_sigint_ends_a_node_that_a_script_started_in_the_background(start):
    # such a process inherits SIGINT ignored
    node = start(command=['sh', '-c', 'trap "" INT; exec "$0" "$@"', *COMMAND])
    wait_for_line(node.stderr, 'ready')
    node.send_signal(signal.SIGINT)
    node.communicate(timeout=LONG)
    assert node.returncode == 0


def test_node_starts_with_the_parameter_file_of_the_package(start):
    node = start('--ros-args', '--params-file', str(ROOT / 'config' / 'refine.yaml'))
    wait_for_line(node.stderr, 'ready')


def test_a_parameter_file_for_other_nodes_is_named(start, tmp_path):
    path = tmp_path / 'params.yaml'
    path.write_text('idem_node:\n  ros__parameters:\n    voxel_size: 0.5\n')
    node = start('--ros-args', '--params-file', str(path), '-r', '__node:=refiner')
    line = wait_for_line(node.stderr, 'speaks to')
    assert f'{path} speaks to idem_node; this is /refiner: nothing of it is taken' in line


@pytest.mark.parametrize(
    ('rule', 'meant'),
    [
        ('target:=/map', '~/target:=/map is meant?'),
        ('/source:=/points', '~/source:=/points is meant?'),
        ('~/inital_guess:=/odom', '~/initial_guess:=/odom is meant?'),
        ('~/target:=/map', None),
        ('/idem_node/target:=/map', None),
        ('/tf:=tf', None),
        ('__node:=idem_node', None),
        ('camera/image:=/image', None),
    ],
)
def test_a_rule_for_a_name_that_nothing_bears_is_named_with_what_is_meant(
    context, capfd, rule, meant
):
    node = Node('idem_node', context=context)
    warn_of_ignored(node, ['idem_node', '--ros-args', '-r', rule])
    node.destroy_node()
    said = capfd.readouterr().err
    assert (meant in said) if meant else not said


@pytest.mark.parametrize(
    ('arguments', 'reason'),
    [
        (['--ros-args', '-p', 'a:=-1.0'], 'a is -1.0; it must be a number from 0.1 to 50'),
        (['--ros-args', '-p', 'reliability:=best'], "reliability is 'best'; it must be one of"),
        (['--ros-args', '-p', 'a'], "parse parameter override rule: '-p a'"),
        (['--ros-args', '--params-file', 'absent.yaml'], 'absent.yaml'),
        (['target.ply'], 'unrecognized target.ply'),
        (['--nonsense'], 'unrecognized --nonsense'),
        (['--find', 'x'], "'x' is no time above 0 and up to an hour"),
        (['--find=nan'], "'nan' is no time above 0 and up to an hour"),
    ],
)
def test_unusable_argument_ends_the_node_with_exit_code_2_and_one_line(
    run_here, arguments, reason
):
    code, errors = run_here(*arguments)
    own = [line for line in errors.splitlines() if line.startswith('idem_node: error: ')]
    assert code == 2
    assert len(own) == 1
    assert reason in own[0]
    assert 'usage' not in errors


def test_a_process_that_refuses_to_start_says_so_without_a_traceback(start):
    node = start('--ros-args', '-p', 'a:=-1.0')
    _, errors = node.communicate(timeout=LONG)
    assert node.returncode == 2
    assert 'Traceback' not in errors


def test_find_on_an_empty_graph_says_so_and_ends(start):
    node = start('--find', '0.5')
    _, errors = node.communicate(timeout=LONG)
    assert node.returncode == 1
    assert 'Traceback' not in errors


def test_an_error_nobody_foresaw_in_a_callback_does_not_end_the_node(context, capfd):
    node, executor = Node('faulty', context=context), SingleThreadedExecutor(context=context)
    executor.add_node(node)
    calls = []

    def callback():
        calls.append(len(calls))
        raise ZeroDivisionError

    node.create_timer(0.01, callback)
    while len(calls) < 5:
        entry._turn(executor, node)
    executor.shutdown()
    node.destroy_node()
    said = capfd.readouterr().err
    assert said.count('Traceback') == 1
    assert said.count('an input is lost: unexpected ZeroDivisionError') == 1
