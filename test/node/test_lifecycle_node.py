"""The managed node in this process: what it does in each state, and what not."""

import threading

import pytest
from live import LONG
from node_bench import FIRST, MS, Bench, cloud_message, guess_message, send, values_of

# isort: split
import numpy as np
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from idem_ros.core import InvalidConfig, register
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.node import live_registration
from idem_ros.node.registration_node import LifecycleRegistrationNode

SUCCESS = TransitionCallbackReturn.SUCCESS


@pytest.fixture
def bench(context):
    b = Bench(context)
    b.make_node(LifecycleRegistrationNode)
    yield b
    b.close()


def activated(bench):
    assert bench.node.trigger_configure() == SUCCESS
    assert bench.node.trigger_activate() == SUCCESS
    return bench.connected()


def interface_of(node):
    """Names under the node that it subscribes to, publishes or serves beside every node's."""
    names = [each.topic_name for each in (*node.subscriptions, *node.publishers)]
    names += [each.srv_name for each in node.services]
    own = [name for name in names if 'idem_node' in name or 'diagnostics' in name]
    standard = ('parameter', 'state', 'transition', 'type_description')
    return [name for name in own if not any(word in name for word in standard)]


def test_active_node_gives_the_transform_that_the_core_gives(bench, clouds):
    b = activated(bench)
    send(b, clouds, FIRST)
    expected = register(*clouds, np.eye(4)).T_target_source
    np.testing.assert_allclose(matrix_of(b.transform_of(FIRST)), expected, rtol=0, atol=1e-9)


def test_unconfigured_node_has_parameters_and_nothing_else(bench):
    assert interface_of(bench.node) == []
    assert bench.node.set_parameters([Parameter('a', value=1.5)])[0].successful
    assert not bench.node.set_parameters([Parameter('a', value=-1.0)])[0].successful


def test_inactive_node_keeps_targets_and_publishes_nothing(bench, clouds):
    b = bench
    assert b.node.trigger_configure() == SUCCESS
    b.until(b.target.get_subscription_count)
    assert b.source.get_subscription_count() == 0
    b.target.publish(cloud_message(clouds[0], FIRST - 10 * MS, 'map'))
    b.guess.publish(guess_message(np.eye(4), FIRST))
    b.until(lambda: b.node.registration.inputs.pairing.waiting_for() == 'source')
    answer = b.asked(Trigger, 'refine_once')
    assert (answer.success, answer.message) == (False, 'the node is not active')
    assert not any(b.received.values())
    assert b.node.trigger_activate() == SUCCESS
    b.connected()
    b.source.publish(cloud_message(clouds[1], FIRST, 'lidar'))
    b.transform_of(FIRST)


def test_deactivation_publishes_what_is_under_way_and_counts_what_waits(
    bench, clouds, monkeypatch
):
    b = activated(bench)
    registration = b.node.registration
    started, proceed = threading.Event(), threading.Event()
    refine = registration.refining.refiner.refine

    def refine_later(pair):
        started.set()
        assert proceed.wait(LONG)
        return refine(pair)

    monkeypatch.setattr(registration.refining.refiner, 'refine', refine_later)
    send(b, clouds, FIRST)
    b.until(started.is_set)
    send(b, clouds, FIRST + 100 * MS, target=False)
    b.until(lambda: registration.refining.waiting == 1)
    b.source.publish(cloud_message(clouds[1], FIRST + 200 * MS, 'lidar'))
    b.until(lambda: registration.inputs.pairing.waiting == 1)
    opener = threading.Timer(0.1, proceed.set)
    opener.start()
    assert b.node.trigger_deactivate() == SUCCESS
    opener.join()
    b.transform_of(FIRST)
    assert registration.dropped == 2
    assert registration.traffic.received == 3
    assert registration.traffic.answered == 1
    b.until(lambda: b.source.get_subscription_count() == 0)
    assert len(list(b.node.timers)) == 1  # which looks after targets and guesses
    assert b.node.trigger_activate() == SUCCESS
    b.connected()
    send(b, clouds, FIRST + 300 * MS, target=False)
    b.transform_of(FIRST + 300 * MS)
    b.until(lambda: any(values_of(each).get('answered') == '2' for each in b.loads()))
    assert values_of(b.loads()[-1])['dropped'] == '2'
    assert [stamp_ns(each) for each in b.received['transform']] == [FIRST, FIRST + 300 * MS]


def test_node_that_was_cleaned_up_begins_anew(bench, clouds):
    b = activated(bench)
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    assert b.node.trigger_deactivate() == SUCCESS
    assert b.node.trigger_cleanup() == SUCCESS
    assert interface_of(b.node) == []
    activated(b)
    assert (
        b.node.registration.inputs.pairing.waiting_for() == 'target and source and initial_guess'
    )
    send(b, clouds, FIRST + 100 * MS)
    b.transform_of(FIRST + 100 * MS)


@pytest.mark.parametrize('steps', [0, 1, 2])
def test_shutdown_from_every_state_leaves_no_thread(bench, steps):
    for trigger in (bench.node.trigger_configure, bench.node.trigger_activate)[:steps]:
        assert trigger() == SUCCESS
    assert bench.node.trigger_shutdown() == SUCCESS
    assert interface_of(bench.node) == []
    assert 'idem_worker' not in {thread.name for thread in threading.enumerate()}


def test_transition_that_fails_leaves_the_state_and_the_next_try_works(bench, clouds, monkeypatch):
    def fail(motion):
        raise InvalidConfig('no compiler')

    monkeypatch.setattr(live_registration, 'warm_up', fail)
    assert bench.node.trigger_configure() == TransitionCallbackReturn.FAILURE
    assert bench.asked(GetState, 'get_state').current_state.id == State.PRIMARY_STATE_UNCONFIGURED
    assert interface_of(bench.node) == []
    monkeypatch.undo()
    b = activated(bench)
    send(b, clouds, FIRST)
    b.transform_of(FIRST)


def test_a_topic_of_another_type_in_the_same_process_fails_the_transition_only(bench, clouds):
    bench.node.set_parameters([Parameter('initial_guess.type', value='odometry')])
    assert bench.node.trigger_configure() == TransitionCallbackReturn.FAILURE
    assert interface_of(bench.node) == []
    bench.node.set_parameters([Parameter('initial_guess.type', value='transform')])
    b = activated(bench)
    send(b, clouds, FIRST)
    b.transform_of(FIRST)


def test_a_manager_leads_the_node_over_its_services(bench, clouds):
    def change(transition):
        request = ChangeState.Request()
        request.transition.id = transition
        client = bench.other.create_client(ChangeState, '/idem_node/change_state')
        bench.until(client.service_is_ready)
        future = client.call_async(request)
        bench.until(future.done)
        return future.result().success

    assert change(Transition.TRANSITION_CONFIGURE)
    assert change(Transition.TRANSITION_ACTIVATE)
    b = bench.connected()
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    assert change(Transition.TRANSITION_DEACTIVATE)
    assert change(Transition.TRANSITION_CLEANUP)
    assert b.asked(GetState, 'get_state').current_state.id == State.PRIMARY_STATE_UNCONFIGURED
