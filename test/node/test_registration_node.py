"""The node in this process: what comes out for what goes in."""

import array
import threading

import pytest
from live import LONG
from node_bench import (
    FIRST,
    MS,
    T_TRUTH,
    cloud_message,
    guess_message,
    send,
    values_of,
)

# isort: split
import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile

from idem_ros.core import register
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.node.registration_node import RegistrationNode

TASKS = ('registration', 'load')


def test_complete_input_gives_the_transform_that_the_core_gives(bench, clouds):
    b = bench().start()
    send(b, clouds, FIRST)
    message = b.transform_of(FIRST)
    assert (message.header.frame_id, message.child_frame_id) == ('map', 'lidar')
    expected = register(*clouds, np.eye(4))
    np.testing.assert_allclose(matrix_of(message), expected.T_target_source, rtol=0, atol=1e-9)
    np.testing.assert_allclose(matrix_of(message), T_TRUTH, rtol=0, atol=0.02)
    b.until(lambda: b.received['q_tot'] and b.statuses('converged'))
    assert b.received['q_tot'][0].data == pytest.approx(expected.q_tot, rel=1e-9)


def test_diagnostics_of_a_result_bear_its_stamp_and_all_values(bench, clouds):
    b = bench().start()
    send(b, clouds, FIRST)
    b.until(lambda: b.statuses('converged'))
    (status,) = b.statuses('converged')
    assert status.level == DiagnosticStatus.OK
    assert (status.name, status.hardware_id) == ('/idem_node: registration', '/idem_node')
    assert status.message == f'aligned: {values_of(status)["verdict_reason"]}'
    values = values_of(status)
    assert list(values) == [
        'q_tot', 'q_mean', 'overlap', 'overlap_source', 'overlap_target', 'radius', 'voxel_size',
        'iterations', 'status', 'reason', 'milliseconds',
        'verdict', 'verdict_reason', 'p_aligned', 'free_motions', 'basin', 'swap_gap',
        'sigma_xyz_m', 'sigma_xyz_rad',
        'reading_ms', 'preparing_ms', 'registering_ms', 'judging_ms',
        'points_target', 'points_source', 'cropped', 'thinned', 'dropped',
    ]  # fmt: skip
    assert values['dropped'] == '0'
    (message,) = [m for m in b.received['diagnostics'] if m.status[0] is status]
    assert stamp_ns(message) == FIRST


def test_statuses_of_two_nodes_can_be_told_apart_by_their_namespaces(bench):
    b = bench()
    for namespace in ('front', 'rear'):
        b.executor.add_node(node := RegistrationNode(context=b.context, namespace=namespace))
        b.others.append(node)
    tasks = [f'/{each}/idem_node: {task}' for each in ('front', 'rear') for task in TASKS]
    heard = b.received['diagnostics']
    b.until(lambda: {m.status[0].name for m in heard} >= set(tasks))
    assert {m.status[0].hardware_id for m in heard} == {'/front/idem_node', '/rear/idem_node'}


def test_one_target_serves_many_sources(bench, clouds):
    b = bench().start()
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    send(b, clouds, FIRST + 100 * MS, target=False)
    again = b.transform_of(FIRST + 100 * MS)
    np.testing.assert_allclose(matrix_of(again), T_TRUTH, rtol=0, atol=0.02)


def test_latched_target_published_before_the_node_started_is_used(bench, clouds):
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    b = bench(target_qos=latched, target_durability='transient_local')
    b.target.publish(cloud_message(clouds[0], FIRST - 10 * MS, 'map'))
    b.start()
    send(b, clouds, FIRST, target=False)
    b.transform_of(FIRST)


def unreadable_clouds():
    good = np.random.default_rng(1).uniform(0, 1, (50, 3))

    def without_x(message):
        message.fields = [field for field in message.fields if field.name != 'x']

    def too_wide(message):
        message.width = 2**31

    def cut_off(message):
        message.data = array.array('B', message.data.tobytes()[:-1])

    def unknown_datatype(message):
        message.fields[0].datatype = 99

    def no_step(message):
        message.point_step = 0

    def no_data(message):
        message.data, message.width = array.array('B'), 0

    reasons = {
        without_x: 'x',
        too_wide: 'bytes',
        cut_off: 'bytes',
        unknown_datatype: '99',
        no_step: 'point_step',
        no_data: 'no ',
    }
    return [
        *(pytest.param(good, *item, id=item[0].__name__) for item in reasons.items()),
        pytest.param(np.full((50, 3), np.nan), lambda message: None, 'usable', id='not_finite'),
        pytest.param(np.zeros((50, 3)), lambda message: None, 'usable', id='all_zero'),
    ]


@pytest.mark.parametrize(('points', 'spoil', 'reason'), unreadable_clouds())
def test_unreadable_source_is_refused_with_a_reason_and_the_next_one_served(
    bench, clouds, points, spoil, reason
):
    b = bench().start()
    bad = cloud_message(points, FIRST, 'lidar')
    spoil(bad)
    b.target.publish(cloud_message(clouds[0], FIRST - 10 * MS, 'map'))
    b.source.publish(bad)
    b.guess.publish(guess_message(np.eye(4), FIRST))
    b.until(lambda: b.statuses('refused'))
    (status,) = b.statuses('refused')
    assert status.level == DiagnosticStatus.ERROR
    assert status.message.startswith('source: ')
    assert reason in status.message
    assert b.received['transform'] == []
    send(b, clouds, FIRST + 100 * MS, target=False)
    b.transform_of(FIRST + 100 * MS)


def test_unreadable_target_is_refused_and_the_next_one_served(bench, clouds):
    b = bench().start()
    bad = cloud_message(clouds[0], FIRST - 10 * MS, 'map')
    bad.fields = []
    b.target.publish(bad)
    send(b, clouds, FIRST, target=False)
    b.until(lambda: b.statuses('refused'))
    assert b.statuses('refused')[0].message.startswith('target: ')
    send(b, clouds, FIRST + 100 * MS)
    b.transform_of(FIRST + 100 * MS)


@pytest.mark.parametrize(
    ('component', 'value', 'reason'),
    [('x', float('nan'), 'not finite'), ('w', 0.0, 'quaternion')],
)
def test_unusable_guess_is_refused_and_the_next_one_served(
    bench, clouds, component, value, reason
):
    b = bench().start()
    bad = guess_message(np.eye(4), FIRST)
    setattr(bad.transform.rotation, component, value)
    b.target.publish(cloud_message(clouds[0], FIRST - 10 * MS, 'map'))
    b.source.publish(cloud_message(clouds[1], FIRST, 'lidar'))
    b.guess.publish(bad)
    b.until(lambda: b.statuses('refused'))
    assert reason in b.statuses('refused')[0].message
    send(b, clouds, FIRST + 100 * MS, target=False)
    b.transform_of(FIRST + 100 * MS)


def test_guess_between_other_frames_is_refused_with_both_names(bench, clouds):
    b = bench().start()
    b.target.publish(cloud_message(clouds[0], FIRST - 10 * MS, 'map'))
    b.source.publish(cloud_message(clouds[1], FIRST, 'lidar'))
    b.guess.publish(guess_message(np.eye(4), FIRST, frame_id='odom'))
    b.until(lambda: b.statuses('refused'))
    (status,) = b.statuses('refused')
    assert "'odom'" in status.message
    assert "'map'" in status.message
    assert b.received['transform'] == []


def test_error_nobody_foresaw_is_reported_and_the_next_input_served(bench, clouds, monkeypatch):
    b = bench().start()
    refiner = b.node.registration.refining.refiner
    refine = refiner.refine
    monkeypatch.setattr(refiner, 'refine', lambda pair: 1 / 0)
    send(b, clouds, FIRST)
    b.until(lambda: b.statuses('refused'))
    assert 'ZeroDivisionError' in b.statuses('refused')[0].message
    monkeypatch.setattr(refiner, 'refine', refine)
    send(b, clouds, FIRST + 100 * MS)
    b.transform_of(FIRST + 100 * MS)


def test_node_says_which_inputs_it_waits_for(bench, clouds):
    b = bench().start()
    b.until(lambda: b.statuses('waiting'))
    first = b.statuses('waiting')[0]
    assert first.level == DiagnosticStatus.STALE
    for name in ('target', 'source', 'initial_guess'):
        assert f'/idem_node/{name} has 1 publisher (' in first.message
    b.target.publish(cloud_message(clouds[0], FIRST, 'map'))
    b.source.publish(cloud_message(clouds[1], FIRST, 'lidar'))
    b.until(lambda: b.statuses('waiting')[-1].message.startswith('waiting for initial_guess ('))


@pytest.mark.parametrize('reliability', ['best_effort', 'reliable'])
def test_inputs_are_subscribed_with_the_reliability_asked_for(bench, reliability):
    node = bench(reliability=reliability).start().node
    for name in ('target', 'source', 'initial_guess'):
        (info,) = node.get_subscriptions_info_by_topic(f'/idem_node/{name}')
        assert info.qos_profile.reliability.name.lower() == reliability


def test_latched_target_is_always_asked_for_reliably(context):
    override = [Parameter('target_durability', value='transient_local')]
    node = RegistrationNode(context=context, parameter_overrides=override)
    (info,) = node.get_subscriptions_info_by_topic('/idem_node/target')
    node.destroy_node()
    assert info.qos_profile.reliability.name == 'RELIABLE'
    assert info.qos_profile.durability.name == 'TRANSIENT_LOCAL'


def test_older_inputs_are_dropped_and_counted_while_one_is_refined(bench, clouds, monkeypatch):
    b = bench().start()
    refiner = b.node.registration.refining.refiner
    started, proceed, refine = threading.Event(), threading.Event(), refiner.refine

    def refine_later(pair):
        started.set()
        proceed.wait(LONG)
        return refine(pair)

    monkeypatch.setattr(refiner, 'refine', refine_later)
    send(b, clouds, FIRST)
    b.until(started.is_set)
    for i in (1, 2, 3):
        send(b, clouds, FIRST + i * 100 * MS, target=False)
    b.until(lambda: b.node.registration.refining.dropped == 2)
    proceed.set()
    b.transform_of(FIRST + 300 * MS)
    b.until(lambda: len(b.statuses('converged')) == 2)
    assert [stamp_ns(message) for message in b.received['transform']] == [FIRST, FIRST + 300 * MS]
    assert values_of(b.statuses('converged')[-1])['dropped'] == '2'


def test_node_says_that_a_refinement_is_under_way(bench, clouds, monkeypatch):
    b = bench().start()
    refiner = b.node.registration.refining.refiner
    proceed, refine = threading.Event(), refiner.refine
    monkeypatch.setattr(refiner, 'refine', lambda pair: proceed.wait(LONG) and refine(pair))
    send(b, clouds, FIRST)
    b.until(lambda: b.statuses('busy'))
    proceed.set()
    assert b.statuses('busy')[-1].level == DiagnosticStatus.OK
