"""The node in this process: a pose to start from, as RViz's "2D Pose Estimate" sends it."""

from node_bench import FIRST, MS, T_TRUTH, cloud_message, guess_message, send

# isort: split
import numpy as np
import pytest
from geometry_msgs.msg import PoseWithCovarianceStamped
from std_srvs.srv import Trigger

from idem_ros.core import register
from idem_ros.core.geometry.se3 import exp
from idem_ros.messages.transform_message import matrix_of

STEP = 100 * MS
NEAR = T_TRUTH @ exp(np.array([0.0, 0.0, 0.01, 0.1, 0.1, 0.0]))


@pytest.fixture
def start(bench, clouds):
    """What starts a node of a type of guess, and publishes a map to it."""

    def started(kind, **options):
        b = bench(guess_type=kind, guess_class=None, **options)
        b.pose = b.other.create_publisher(PoseWithCovarianceStamped, '/initialpose', 10)
        b.start()
        b.until(b.pose.get_subscription_count)
        b.target.publish(cloud_message(clouds[0], FIRST - STEP, 'map'))
        return b

    return started


def clicked(pose, frame='map', stamp=0):
    stamped = guess_message(pose, stamp, frame).transform
    message = PoseWithCovarianceStamped()
    message.header.frame_id = frame
    t, p = stamped.translation, message.pose.pose.position
    p.x, p.y, p.z = t.x, t.y, t.z
    message.pose.pose.orientation = stamped.rotation
    return message


def answer_from(clouds, guess):
    return register(*clouds, guess).T_target_source


def assert_answers(b, clouds, guesses, first=0):
    """Publish a source for each guess, and compare the answer with that of the core."""
    for i, guess in enumerate(guesses, start=first):
        send(b, clouds, FIRST + i * STEP, target=False)
        found = matrix_of(b.transform_of(FIRST + i * STEP))
        np.testing.assert_allclose(found, answer_from(clouds, guess), rtol=0, atol=1e-9)


def test_sources_wait_for_the_pose_and_then_go_on_from_the_last_result(start, clouds):
    b = start('initial_pose')
    send(b, clouds, FIRST, target=False)
    b.until(lambda: b.statuses('waiting'))
    b.until(lambda: 'no pose has come to start from' in b.statuses('waiting')[-1].message)
    assert '/initialpose has 1 publisher (PoseWith' in b.statuses('waiting')[-1].message
    assert b.received['transform'] == []
    b.pose.publish(clicked(NEAR))
    first = answer_from(clouds, NEAR)
    found = matrix_of(b.transform_of(FIRST))
    np.testing.assert_allclose(found, first, rtol=0, atol=1e-9)
    assert_answers(b, clouds, [first], first=1)


def test_a_pose_that_is_remapped_to_the_topic_of_guesses_serves_as_well(bench, clouds):
    b = bench(guess_type='initial_pose', guess_class=PoseWithCovarianceStamped).start()
    b.target.publish(cloud_message(clouds[0], FIRST - STEP, 'map'))
    b.guess.publish(clicked(NEAR))
    b.source.publish(cloud_message(clouds[1], FIRST, 'lidar'))
    found = matrix_of(b.transform_of(FIRST))
    np.testing.assert_allclose(found, answer_from(clouds, NEAR), rtol=0, atol=1e-9)


@pytest.mark.parametrize('kind', ['initial_pose', 'last'])
def test_another_pose_begins_anew(start, clouds, kind):
    b = start(kind)
    b.pose.publish(clicked(NEAR))
    b.until(lambda: b.node.registration.inputs.pairing._guesses._first)
    assert_answers(b, clouds, [NEAR, answer_from(clouds, NEAR)])
    first = b.node.registration.inputs.pairing._guesses._first
    b.pose.publish(clicked(np.eye(4), stamp=FIRST))
    b.until(lambda: b.node.registration.inputs.pairing._guesses._first is not first)
    assert_answers(b, clouds, [np.eye(4)], first=2)


def test_reset_forgets_the_last_result(start, clouds):
    b = start('last')
    assert_answers(b, clouds, [np.eye(4), answer_from(clouds, np.eye(4))])
    answer = b.asked(Trigger, 'reset')
    assert answer.success
    assert_answers(b, clouds, [np.eye(4)], first=2)


def test_reset_says_where_nothing_is_to_be_reset(bench):
    answer = bench().start().asked(Trigger, 'reset')
    assert not answer.success
    assert 'initial_guess.type is transform' in answer.message


def test_a_pose_that_nobody_listens_to_is_named_with_the_type_that_would(bench):
    b = bench(guess_class=None)
    b.other.create_publisher(PoseWithCovarianceStamped, '/initialpose', 10)
    b.start()
    hint = '/initialpose is published, which initial_guess.type initial_pose would listen to'
    b.until(lambda: b.statuses('waiting') and hint in b.statuses('waiting')[-1].message)
