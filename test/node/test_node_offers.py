"""The node in this process: publishers of other qualities of service or types than it expects."""

from node_bench import FIRST, MS, cloud_message, guess_message, send

# isort: split
import subprocess
import sys

import numpy as np
import pytest
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2

from idem_ros.messages.building import CLOUD
from idem_ros.node.publisher_qos import Offer, in_words, why_unheard
from idem_ros.pairing.guesses import TF

LATCHED = QoSProfile(
    depth=1,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
    reliability=ReliabilityPolicy.RELIABLE,
)
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
BEST_EFFORT_LATCHED = QoSProfile(
    depth=1,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
    reliability=ReliabilityPolicy.BEST_EFFORT,
)
STEP = 100 * MS


def durabilities(b):
    held = b.node.registration.inputs.subscriptions.held['target']
    return [each.qos_profile.durability.name for each in held]


def test_a_map_that_was_published_once_before_the_node_started_is_received(bench, clouds):
    b = bench(target_qos=LATCHED)
    b.target.publish(cloud_message(clouds[0], FIRST - STEP, 'map'))
    b.start()
    send(b, clouds, FIRST, target=False)
    b.transform_of(FIRST)
    assert durabilities(b) == ['TRANSIENT_LOCAL']


def test_a_latched_map_and_a_stream_of_targets_are_both_heard(bench, clouds):
    b = bench(target_qos=LATCHED)
    b.target.publish(cloud_message(clouds[0], FIRST - STEP, 'map'))
    stream = b.other.create_publisher(PointCloud2, '/idem_node/target', 10)
    b.start()
    send(b, clouds, FIRST, target=False)
    b.transform_of(FIRST)
    b.until(lambda: durabilities(b) == ['VOLATILE', 'TRANSIENT_LOCAL'])
    newest = cloud_message(clouds[0], FIRST + STEP, 'map')
    stream.publish(newest)
    targets = b.node.registration.inputs.pairing._targets
    b.until(lambda: [each.stamp for each in targets._kept] == [FIRST - STEP, FIRST + STEP])
    b.other.destroy_publisher(b.target)
    b.until(lambda: durabilities(b) == ['VOLATILE'])


@pytest.mark.parametrize(
    ('options', 'quality', 'words'),
    [
        (
            {'reliability': 'reliable'},
            BEST_EFFORT,
            ['offers best_effort, the node asks for reliable: set reliability to best_effort'],
        ),
        (
            {'target_durability': 'transient_local'},
            10,
            ['asks for transient_local: set target_durability to auto', 'reliable, volatile'],
        ),
    ],
)
def test_a_publisher_that_offers_less_than_is_asked_for_is_named_with_the_remedy(
    bench, options, quality, words
):
    b = bench(target_qos=quality, **options)
    b.make_node()
    b.until(lambda: b.statuses('waiting'))
    b.until(lambda: all(word in b.statuses('waiting')[-1].message for word in words))
    assert '/idem_node/target: /other offers' in b.statuses('waiting')[-1].message
    b.until(lambda: any('/idem_node/target: /other offers' in m.message for m in b.loads()))


PUBLISHER = """
import rclpy, sys
from geometry_msgs.msg import PoseWithCovarianceStamped
rclpy.init()
node = rclpy.create_node('rviz')
publisher = node.create_publisher(PoseWithCovarianceStamped, '/idem_node/initial_guess', 10)
print('ready', flush=True)
sys.stdin.read()
"""


@pytest.fixture
def rviz(context):
    """Another process: in one, DDS lets no topic have two types."""
    with subprocess.Popen(
        [sys.executable, '-c', PUBLISHER],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as process:
        assert process.stdout.readline() == b'ready\n'
        yield
        process.stdin.close()


@pytest.mark.parametrize(
    ('kind', 'remedy'),
    [
        ('last', 'to pose_with_covariance, or for a single pose to initial_pose'),
        ('transform', 'set initial_guess.type to pose_with_covariance'),
    ],
)
def test_a_guess_of_another_type_is_named_with_both_types(bench, rviz, kind, remedy):
    b = bench(guess_type=kind, guess_class=None).start()
    theirs = (
        '/idem_node/initial_guess: /rviz publishes geometry_msgs/msg/PoseWithCovarianceStamped'
    )
    b.until(lambda: b.loads() and theirs in b.loads()[-1].message)
    assert 'the node listens for geometry_msgs/msg/TransformStamped' in b.loads()[-1].message
    assert remedy in b.loads()[-1].message
    b.until(lambda: b.statuses('waiting') and theirs in b.statuses('waiting')[-1].message)


def test_a_guess_of_the_right_type_is_no_mismatch(bench):
    b = bench(guess_type='pose_with_covariance', guess_class=PoseWithCovarianceStamped).start()
    b.until(lambda: len(b.loads()) > 1)
    assert b.node.registration.inputs.unheard == []


def test_a_guess_that_was_published_once_before_the_node_started_is_received(bench, clouds):
    b = bench(guess_class=None)
    guess = b.other.create_publisher(TransformStamped, '/idem_node/initial_guess', LATCHED)
    guess.publish(guess_message(np.eye(4), 0))
    b.start()
    send(b, clouds, FIRST)
    b.transform_of(FIRST)


@pytest.mark.parametrize(
    ('msgtype', 'asked', 'offered', 'remedy'),
    [
        (CLOUD, LATCHED, BEST_EFFORT_LATCHED, 'set target_durability to auto'),
        (TF, LATCHED, QoSProfile(depth=1), 'have it published as tf2 does'),
        (TF, QoSProfile(depth=1), BEST_EFFORT, 'have it published as tf2 does'),
    ],
)
def test_the_remedy_is_one_that_helps_the_input(msgtype, asked, offered, remedy):
    said = why_unheard(msgtype, [asked], Offer('/slam', msgtype, offered))
    assert said.endswith(remedy)


def test_a_map_that_is_kept_and_never_sent_again_is_named():
    said = in_words('/map', [Offer('/slam', CLOUD, BEST_EFFORT_LATCHED)])
    assert 'nothing from before is sent: that takes reliable' in said
