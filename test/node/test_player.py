"""A recording on live topics, in this process."""

import time

import pytest
from live import rclpy, spin_until

# isort: split
import numpy as np
from geometry_msgs.msg import TransformStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from recordings import START, STEP, scans, write_rosbag1
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2

from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.node.player import NothingToPlay, Pace, Player
from idem_ros.recording.messages import typestore
from idem_ros.recording.reader import open_recording
from idem_ros.recording.writer import write_mcap

CLASSES = {
    '/target': PointCloud2,
    '/source': PointCloud2,
    '/initial_guess': TransformStamped,
    '/ground_truth': TransformStamped,
}


@pytest.fixture
def node(context):
    node = Node('player', context=context)
    yield node
    node.destroy_node()


@pytest.fixture
def listener(context):
    """Keeps what arrives on each topic."""
    node = Node('listener', context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    class Listener:
        received = {name: [] for name in CLASSES}

        def listen(self, name, kind, quality=10):
            kept = self.received.setdefault(name, [])
            node.create_subscription(kind, name, kept.append, quality)

        def until(self, condition):
            spin_until(executor, condition)

    yield Listener()
    executor.shutdown()
    node.destroy_node()


@pytest.fixture
def logged(rng):
    return list(scans(rng))


def play_all(player, recording):
    return [player.publish(*each) for each in recording.messages(list(recording.topics))]


def write_bag(tmp_path, suffix, logged):
    path = tmp_path / f'scans{suffix}'
    (write_rosbag1 if suffix == '.bag' else write_mcap)(path, logged)
    return path


@pytest.mark.parametrize('suffix', ['.mcap', '.bag'])
def test_every_message_arrives_as_it_was_recorded(node, listener, tmp_path, logged, suffix):
    with open_recording(write_bag(tmp_path, suffix, logged)) as recording:
        player = Player(node, recording)
        for name, kind in CLASSES.items():
            listener.listen(name, kind)
        listener.until(player.is_heard)
        assert all(play_all(player, recording))
        listener.until(lambda: sum(map(len, listener.received.values())) == len(logged))
    for name in CLASSES:
        expected = [message for topic, _, message in logged if topic == name]
        assert [stamp_ns(each) for each in listener.received[name]] == list(
            map(stamp_ns, expected)
        )
        read = read_points if CLASSES[name] is PointCloud2 else matrix_of
        for arrived, recorded in zip(listener.received[name], expected, strict=True):
            assert arrived.header.frame_id == recorded.header.frame_id
            points = [getattr(read(each), 'points', read(each)) for each in (arrived, recorded)]
            np.testing.assert_array_equal(*points)


def test_target_is_latched_for_those_who_subscribe_later(node, listener, tmp_path, logged):
    with open_recording(write_bag(tmp_path, '.mcap', logged)) as recording:
        player = Player(node, recording)
        play_all(player, recording)
        quality = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        listener.listen('/target', PointCloud2, quality)
        listener.until(lambda: listener.received['/target'])


def test_log_times_are_published_as_clock(node, listener, tmp_path, logged):
    with open_recording(write_bag(tmp_path, '.mcap', logged)) as recording:
        player = Player(node, recording, with_clock=True)
        listener.listen('/clock', Clock, 100)
        listener.until(lambda: node.count_subscribers('/clock'))
        for each in recording.messages(player.topics):
            player.publish(*each)
        listener.until(lambda: len(listener.received['/clock']) == len(logged))
    times = [each.clock.sec * 10**9 + each.clock.nanosec for each in listener.received['/clock']]
    assert times == [log_time for _, log_time, _ in logged]


def test_topic_of_a_type_that_is_not_installed_is_skipped_with_a_reason(node, tmp_path, logged):
    types = typestore().types
    transforms = types['tf2_msgs/msg/TFMessage'](transforms=[logged[2][2]])
    path = write_bag(tmp_path, '.mcap', [*logged, ('/tf', START + 10 * STEP, transforms)])
    with open_recording(path) as recording:
        player = Player(node, recording)
        if '/tf' in player.topics:
            pytest.skip('tf2_msgs is installed here')
        assert 'tf2_msgs' in player.skipped['/tf']
        assert play_all(player, recording).count(False) == 1


def test_recording_without_any_topic_to_publish_is_refused(node, tmp_path):
    path = tmp_path / 'empty.mcap'
    write_mcap(path, [])
    with open_recording(path) as recording, pytest.raises(NothingToPlay, match='empty.mcap'):
        Player(node, recording)


def test_waiting_for_subscribers_ends_without_any(node, tmp_path, logged):
    with open_recording(write_bag(tmp_path, '.mcap', logged)) as recording:
        assert not Player(node, recording).wait_for_subscribers(patience=0.1)


def test_waiting_for_subscribers_ends_once_nobody_joins_any_more(node, listener, tmp_path, logged):
    with open_recording(write_bag(tmp_path, '.mcap', logged)) as recording:
        player = Player(node, recording)
        listener.listen('/source', PointCloud2)
        assert player.wait_for_subscribers(patience=60.0, settling=0.1)


@pytest.mark.parametrize('rate', [1.0, 4.0])
def test_no_message_is_due_before_its_time(rate):
    pace, start = Pace(rate), time.monotonic()
    for log_time in (START, START + STEP // 2, START + STEP):
        pace.wait(log_time)
        assert time.monotonic() - start >= (log_time - START) / 1e9 / rate


def test_message_that_is_overdue_is_not_held_back(monkeypatch):
    slept = []
    monkeypatch.setattr('idem_ros.node.player.time.sleep', slept.append)
    pace = Pace(1.0)
    pace.wait(START)
    pace.wait(START - STEP)
    assert slept == [0.0, 0.0]


def test_rclpy_is_shut_down_after_a_player_failed():
    from idem_ros.node.player import playing_node

    with pytest.raises(OSError, match='disk'), playing_node('fails'):
        raise OSError('disk')
    assert not rclpy.ok()
