"""`idem play` as a user runs it."""

import signal
import subprocess
import sys

import pytest
from live import LONG, own_graph, rclpy, spin_until, wait_for_line

# isort: split
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from recordings import scans
from sensor_msgs.msg import PointCloud2

from idem_ros.commands import play
from idem_ros.commands.main import main
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.recording.writer import write_mcap

PLAY = [sys.executable, '-m', 'idem_ros.commands.entry', 'play']


@pytest.fixture
def bag(tmp_path, rng):
    path = tmp_path / 'scans.mcap'
    write_mcap(path, scans(rng))
    return str(path)


@pytest.fixture
def start():
    processes = []

    def start(*arguments):
        pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE}
        processes.append(subprocess.Popen([*PLAY, *arguments], text=True, **pipes))
        return processes[-1]

    yield start
    for process in processes:
        process.terminate()
        process.wait()
        process.stdout.close()
        process.stderr.close()


@pytest.fixture
def sources():
    """Subscribe to /source in a domain that a child process inherits."""
    with own_graph() as context:
        node = Node('listener', context=context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        stamps = []

        class Sources:
            def until(self, condition):
                spin_until(executor, lambda: condition(stamps))

        subscription = node.create_subscription(
            PointCloud2, '/source', lambda message: stamps.append(stamp_ns(message)), 50
        )
        yield Sources()
        node.destroy_subscription(subscription)
        executor.shutdown()
        node.destroy_node()


def test_recording_is_played_once_and_counted(start, sources, bag):
    process = start(bag, '--rate', '5')
    sources.until(lambda stamps: len(stamps) == 3)
    output, errors = process.communicate(timeout=LONG)
    assert process.returncode == 0
    assert '10 messages of 4 topics played' in output
    assert 'waits up to 10 s for a subscriber' in errors
    assert 'nobody listens' not in errors


@pytest.mark.parametrize(('signum', 'code'), [(signal.SIGINT, 0), (signal.SIGTERM, 143)])
def test_loop_starts_over_until_a_signal_ends_it(start, sources, bag, signum, code):
    process = start(bag, '--rate', '5', '--loop')
    sources.until(lambda stamps: stamps.count(stamps[0]) == 2 if stamps else False)
    process.send_signal(signum)
    _, errors = process.communicate(timeout=LONG)
    assert process.returncode == code
    assert 'Traceback' not in errors


def test_ctrl_c_in_a_single_pass_is_an_interruption(start, sources, bag):
    process = start(bag, '--rate', '0.1')
    wait_for_line(process.stderr, 'waits up to')
    sources.until(len)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=LONG)
    assert process.returncode == 130
    assert 'Traceback' not in errors


def test_what_nobody_listens_to_is_said_with_how_to_remap_the_node(
    bag, sources, monkeypatch, capsys
):
    monkeypatch.setattr(play, 'PATIENCE', 1.0)
    sources.until(lambda stamps: True)
    assert main(['play', bag, '--rate', '5']) == 0
    errors = capsys.readouterr().err
    assert 'nobody listened to /target, /initial_guess: start the node with --ros-args ' in errors
    assert "-r '~/target:=/target' -r '~/initial_guess:=/initial_guess'" in errors


def test_a_recording_that_nobody_listens_to_at_all_is_a_failure(bag, context, monkeypatch, capsys):
    monkeypatch.setattr(play, 'PATIENCE', 0.2)
    assert main(['play', bag, '--rate', '5']) == 1
    output = capsys.readouterr()
    assert '10 messages of 4 topics played' in output.out
    assert 'nobody listened to /target, /source, /initial_guess: start the node' in output.err
    assert "-r '~/source:=/source'" in output.err


@pytest.mark.parametrize('rate', ['0', '-1', 'nan', 'inf', 'fast'])
def test_rate_that_is_none_is_refused(bag, rate, capsys):
    with pytest.raises(SystemExit) as ended:
        main(['play', bag, f'--rate={rate}'])
    assert ended.value.code == 2
    assert 'no number above 0' in capsys.readouterr().err


def test_recording_that_is_not_there_is_refused_in_one_line(capsys):
    assert main(['play', 'absent.mcap']) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert 'absent.mcap does not exist' in line


@pytest.mark.parametrize('command', ['play', 'demo'])
def test_missing_rclpy_is_said_with_what_to_install(bag, command, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'rclpy', None)
    assert main([command, bag]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert f'idem {command} works on live ROS 2 topics and needs rclpy' in line
    assert 'ros-jazzy-rclpy[fastrtps]' in line
    assert rclpy is not None


@pytest.mark.parametrize('name', ['idem_node', 'idem_lifecycle_node'])
def test_a_node_without_rclpy_says_what_to_install(name):
    main_of = {'idem_node': 'main', 'idem_lifecycle_node': 'main_managed'}[name]
    code = (
        "import sys; sys.modules['rclpy'] = None; from idem_ros.node import entry;"
        f'sys.exit(entry.{main_of}())'
    )
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert f'{name} works on live ROS 2 topics and needs rclpy' in line
