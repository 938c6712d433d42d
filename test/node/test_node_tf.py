"""The node in this process, with its guesses from tf."""

from importlib.util import find_spec

import poses
import pytest
from node_bench import FIRST, MS, T_TRUTH, cloud_message, guess_message, publish_clouds, send

# isort: split
import numpy as np
from geometry_msgs.msg import Twist
from rclpy.parameter import Parameter

from idem_ros.core import InvalidConfig, register
from idem_ros.core.geometry.se3 import translation
from idem_ros.messages.transform_message import matrix_of
from idem_ros.node import subscriptions


@pytest.mark.skipif(find_spec('tf2_msgs') is not None, reason='tf2_msgs is installed here')
def test_change_to_tf_without_its_messages_is_refused_with_the_package_to_install(bench, clouds):
    b = bench().start()
    (result,) = b.node.set_parameters([Parameter('initial_guess.type', value='tf')])
    assert not result.successful
    assert 'apt install ros-jazzy-tf2-msgs' in result.reason
    send(b, clouds, FIRST)
    b.transform_of(FIRST)


@pytest.mark.skipif(find_spec('tf2_msgs') is not None, reason='tf2_msgs is installed here')
def test_tf_without_its_messages_ends_the_start_with_the_package_to_install(bench):
    with pytest.raises(InvalidConfig, match='apt install ros-jazzy-tf2-msgs'):
        bench(guess_type='tf', guess_class=None).start()


@pytest.fixture
def without_tf_messages(monkeypatch):
    """Where no package has the messages of tf: they are handed to the node."""
    class_of = subscriptions._class_of
    monkeypatch.setattr(
        subscriptions,
        '_class_of',
        lambda msgtype, kind: Twist if 'tf2_msgs' in msgtype else class_of(msgtype, kind),
    )


@pytest.fixture
def tf_bench(bench, without_tf_messages):
    return bench(guess_type='tf', guess_class=None).start()


def test_a_map_in_utm_is_met_through_the_tf_trees_own_origin(
    bench, without_tf_messages, clouds, tmp_path
):
    utm = np.array([4e5, 5e6, 0.0])
    np.save(tmp_path / 'map.npy', clouds[0] + utm)
    told = {'target_file': str(tmp_path / 'map.npy'), 'target_frame': 'utm'}
    b = bench(guess_type='tf', guess_class=None, **told)
    b.make_node()
    b.until(b.source.get_subscription_count)
    held = b.node.registration.inputs.subscriptions.held
    origin = guess_message(translation(utm), 0, 'utm', 'map')
    held['tf_static'][0].callback(poses.tf(origin, guess_message(np.eye(4), 0, 'base', 'lidar')))
    for shift in (-50 * MS, 50 * MS):
        moving = guess_message(np.eye(4), FIRST + shift, 'map', 'base')
        held['tf'][0].callback(poses.tf(moving))
    b.source.publish(cloud_message(clouds[1], FIRST, 'lidar'))
    found = matrix_of(b.transform_of(FIRST))
    found[:3, 3] -= utm
    np.testing.assert_allclose(found, register(*clouds).T_target_source, rtol=0, atol=5e-4)


def test_guess_from_tf_is_the_way_from_source_to_target_at_the_stamp(tf_bench, clouds):
    b = tf_bench
    publish_clouds(b, clouds, FIRST)
    b.until(lambda: b.statuses('waiting') and 'lidar' in b.statuses('waiting')[-1].message)
    text = b.statuses('waiting')[-1].message
    assert text.startswith('waiting for initial_guess (/tf has 0 publishers, /tf_static has 0')
    assert "tf does not connect the source frame 'lidar' with the target frame 'map'" in text
    b.node.registration.inputs.subscriptions.held['tf_static'][0].callback(
        poses.tf(guess_message(np.eye(4), 0, 'base', 'lidar'))
    )
    for shift in (-50 * MS, 50 * MS):
        moving = guess_message(np.eye(4), FIRST + shift, 'map', 'base')
        b.node.registration.inputs.subscriptions.held['tf'][0].callback(poses.tf(moving))
    np.testing.assert_allclose(matrix_of(b.transform_of(FIRST)), T_TRUTH, rtol=0, atol=0.02)


def test_transform_that_tf_lacks_is_a_refusal_with_the_frames_named(tf_bench, clouds):
    b = tf_bench
    publish_clouds(b, clouds, FIRST)
    publish_clouds(b, clouds, FIRST + 100 * MS)
    b.until(lambda: b.statuses('refused'))
    assert "'lidar' with the target frame 'map'" in b.statuses('refused')[0].message
    assert b.received['transform'] == []


def test_tf_is_subscribed_as_tf2_does(tf_bench):
    qualities = {}
    for topic in ('/tf', '/tf_static'):
        (info,) = tf_bench.node.get_subscriptions_info_by_topic(topic)
        quality = info.qos_profile
        qualities[topic] = quality.reliability.name, quality.durability.name
    assert qualities == {
        '/tf': ('RELIABLE', 'VOLATILE'),
        '/tf_static': ('RELIABLE', 'TRANSIENT_LOCAL'),
    }
