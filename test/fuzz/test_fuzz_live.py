"""Malformed messages through the live node: it lives on and answers the good ones after them."""

import os

import pytest
from live import LONG, own_graph, rclpy  # noqa: F401  (before the messages, so that they check fields)

# isort: split
import numpy as np
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from malformed import END_OF_TIME, SECOND, SOURCE, cloud, spoilt, stamped
from node_bench import Bench, cloud_message, corner, guess_message
from rclpy.duration import Duration

from idem_ros.recording.messages import to_cdr, typestore

EXAMPLES = max(int(os.environ.get('IDEM_FUZZ', '500')) // 10, 10)
AFTER = 1_700_001_000 * SECOND  # later than the malformed ones but for those of the end of time
READY_AT_ONCE = 10  # callbacks of the node and of the bench, at most
CLOUDS = [points[::4] for points in corner()]


@pytest.fixture(scope='module')
def bench():
    with own_graph() as context:
        bench = Bench(context, voxel_size=0.2, radius_schedule=[2.0, 1.0]).start()
        bench.sent = 0
        yield bench
        bench.close()


def as_cdr(message):
    """Return a message as the bytes that a driver would send."""
    types = typestore().types
    field = types['sensor_msgs/msg/PointField']
    time = types['builtin_interfaces/msg/Time'](**vars(message.header.stamp))
    header = types['std_msgs/msg/Header'](stamp=time, frame_id=message.header.frame_id)
    fields = [field(**vars(each)) for each in message.fields]
    whole = {**vars(message), 'header': header, 'fields': fields}
    return to_cdr(types['sensor_msgs/msg/PointCloud2'](**whole))


@settings(
    max_examples=EXAMPLES,
    deadline=None,
    derandomize=True,
    phases=[Phase.generate],  # shrinking waits for an answer each time
    suppress_health_check=[HealthCheck.too_slow],
)
@given(
    role=st.sampled_from(['target', 'source']),
    message=spoilt(lowest=0),
)
def test_node_answers_the_good_pair_after_a_malformed_message(bench, role, message):
    assert_answers_after(bench, getattr(bench, role), message)


def assert_answers_after(bench, publisher, message):
    send(bench, bench.guess, guess_message(np.eye(4), 0, '', ''))  # serves every source
    send(bench, publisher, as_cdr(message))
    bench.sent += 1
    stamp = AFTER + bench.sent * 100 * SECOND
    send(bench, bench.target, cloud_message(CLOUDS[0], stamp, 'map'))
    send(bench, bench.guess, guess_message(np.eye(4), stamp))
    send(bench, bench.source, cloud_message(CLOUDS[1], stamp, 'lidar'))
    bench.transform_of(stamp)
    assert 'unexpected' not in ' '.join(each.message for each in bench.statuses('refused'))
    for received in bench.received.values():
        received.clear()


def send(bench, publisher, message):
    """Publish a message and let the node take it, before one of another topic overtakes it."""
    publisher.publish(message)
    assert publisher.wait_for_all_acked(Duration(seconds=LONG))
    for _ in range(READY_AT_ONCE):
        bench.executor.spin_once(timeout_sec=0.0)


@pytest.mark.parametrize('width', [0, 45])
def test_source_later_than_any_stamp_is_reported_and_the_node_lives_on(bench, width):
    message = cloud(SOURCE[::10], 0, 'lidar')
    message.width, message.header = width, stamped(*END_OF_TIME, 'lidar')
    send(bench, bench.target, cloud_message(CLOUDS[0], AFTER, 'map'))
    assert_answers_after(bench, bench.source, message)
