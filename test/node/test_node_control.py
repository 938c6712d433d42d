"""The node in this process: its services, and what it does when the world around it breaks."""

import threading
from types import SimpleNamespace

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
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool, Trigger

from idem_ros.core import RegistrationConfig, register
from idem_ros.core.geometry.se3 import transform_points
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.node import diagnostics_publisher


class Gate:
    """Holds each refinement back until it is let through."""

    def __init__(self, registration, monkeypatch):
        self.refine = registration.refining.refiner.refine
        self.begun, self.proceed = [], threading.Semaphore(0)
        monkeypatch.setattr(registration.refining.refiner, 'refine', self._refine)

    def _refine(self, pair):
        self.begun.append(pair.stamp)
        assert self.proceed.acquire(timeout=LONG)
        return self.refine(pair)


def stamps(bench):
    return [stamp_ns(message) for message in bench.received['transform']]


def accounts(bench):
    """The newest counts of sources that the node has told."""
    values = values_of(bench.loads()[-1]) if bench.loads() else {}
    names = ('received', 'answered', 'refused', 'dropped', 'waiting')
    return tuple(int(values.get(name, -1)) for name in names)


def test_refine_once_says_what_is_missing_where_there_is_no_pair(bench):
    answer = bench().start().asked(Trigger, 'refine_once')
    assert not answer.success
    assert answer.message.startswith('no pair yet: waiting for target and source')


def test_refine_once_refines_the_newest_pair_once_more_and_counts_it_once(bench, clouds):
    b = bench().start()
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    b.node.set_parameters([Parameter('max_iterations', value=1)])
    answer = b.asked(Trigger, 'refine_once')
    assert not answer.success
    assert 'max_iterations: q_tot ' in answer.message
    assert f'stamp {FIRST // 10**9}.000000000' in answer.message
    b.until(lambda: stamps(b) == [FIRST, FIRST])
    b.until(lambda: accounts(b) == (1, 1, 0, 0, 0))


def test_refine_once_answers_with_the_reason_of_a_refusal(bench, clouds):
    b = bench().start()
    bad = cloud_message(clouds[1], FIRST, 'lidar')
    bad.fields = []
    b.target.publish(cloud_message(clouds[0], FIRST - 10 * MS, 'map'))
    b.source.publish(bad)
    b.guess.publish(guess_message(np.eye(4), FIRST))
    b.until(lambda: b.statuses('refused'))
    answer = b.asked(Trigger, 'refine_once')
    assert not answer.success
    assert answer.message.startswith("refused: source: it has no field 'x'")
    b.until(lambda: accounts(b) == (1, 0, 1, 0, 0))


def test_paused_node_refines_nothing_but_what_it_is_asked_for(bench, clouds):
    b = bench().start()
    assert b.asked(SetBool, 'pause', data=True).success
    for i in range(3):
        send(b, clouds, FIRST + i * 100 * MS)
    b.until(lambda: b.node.registration.dropped == 2)
    b.until(lambda: b.statuses('paused'))
    assert b.statuses('paused')[-1].level == DiagnosticStatus.WARN
    assert b.received['transform'] == []
    assert b.asked(Trigger, 'refine_once').success
    b.transform_of(FIRST + 200 * MS)
    b.until(lambda: accounts(b) == (3, 1, 0, 2, 0))
    assert b.asked(SetBool, 'pause', data=False).success
    send(b, clouds, FIRST + 300 * MS)
    b.transform_of(FIRST + 300 * MS)
    assert stamps(b) == [FIRST + 200 * MS, FIRST + 300 * MS]


def test_newest_pair_of_a_pause_is_refined_when_it_ends(bench, clouds):
    b = bench().start()
    b.asked(SetBool, 'pause', data=True)
    send(b, clouds, FIRST)
    b.until(lambda: b.node.registration.refining.waiting == 1)
    b.asked(SetBool, 'pause', data=False)
    b.transform_of(FIRST)
    b.until(lambda: accounts(b) == (1, 1, 0, 0, 0))


def test_clouds_keep_coming_while_a_service_waits(bench, clouds, monkeypatch):
    b = bench().start()
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    gate = Gate(b.node.registration, monkeypatch)
    client = b.other.create_client(Trigger, '/idem_node/refine_once')
    b.until(client.service_is_ready)
    future = client.call_async(Trigger.Request())
    b.until(lambda: gate.begun)
    for i in (1, 2):
        send(b, clouds, FIRST + i * 100 * MS)
    b.until(lambda: b.node.registration.dropped == 1)
    assert not future.done()
    gate.proceed.release(2)
    b.until(future.done)
    assert future.result().success
    b.transform_of(FIRST + 200 * MS)
    b.until(lambda: accounts(b) == (3, 2, 0, 1, 0))


def test_service_that_waits_is_answered_when_the_worker_is_stopped(bench, clouds, monkeypatch):
    b = bench().start()
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    registration = b.node.registration
    gate = Gate(registration, monkeypatch)
    futures = [registration.refine_once() for _ in range(2)]
    b.until(lambda: gate.begun)
    opener = threading.Timer(0.1, gate.proceed.release)
    opener.start()
    registration.stop()
    opener.join()
    assert futures[0].result(LONG).success
    assert futures[1].cancelled()
    assert registration.refine_once().result(LONG).message == 'the node is not active'


def test_target_replaced_in_mid_refinement_serves_the_next_source_only(bench, clouds, monkeypatch):
    b = bench().start()
    gate = Gate(b.node.registration, monkeypatch)
    send(b, clouds, FIRST)
    b.until(lambda: gate.begun)
    shift = np.eye(4)
    shift[0, 3] = 0.05
    moved = transform_points(shift, clouds[0])
    b.target.publish(cloud_message(moved, FIRST + 10 * MS, 'map'))
    send(b, clouds, FIRST + 100 * MS, target=False)
    b.until(lambda: b.node.registration.refining.waiting == 1)
    gate.proceed.release(2)
    for stamp, target in ((FIRST, clouds[0]), (FIRST + 100 * MS, moved)):
        expected = register(target, clouds[1], np.eye(4)).T_target_source
        found = matrix_of(b.transform_of(stamp))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_parameters_changed_under_load_hold_for_whole_refinements_only(bench, clouds):
    b = bench().start()
    configs = [
        RegistrationConfig(max_iterations=1, voxel_size=0.2),
        RegistrationConfig(max_iterations=50, voxel_size=0.1),
    ]
    expected = [register(*clouds, np.eye(4), config).T_target_source for config in configs]
    for i in range(20):
        config = configs[i % 2]
        result = b.node.set_parameters_atomically(
            [
                Parameter('max_iterations', value=config.max_iterations),
                Parameter('voxel_size', value=config.voxel_size),
            ]
        )
        assert result.successful
        send(b, clouds, FIRST + i * 100 * MS, target=i == 0)
        b.executor.spin_once(timeout_sec=0.01)
    b.transform_of(FIRST + 1900 * MS)
    for message in b.received['transform']:
        off = [np.abs(matrix_of(message) - each).max() for each in expected]
        assert min(off) < 1e-9
    b.until(lambda: sum(accounts(b)[1:]) == 20)
    assert accounts(b)[0] == 20


def test_publisher_that_vanishes_in_mid_stream_is_missed_and_served_when_it_is_back(
    bench, clouds, monkeypatch
):
    now = [100.0]
    monkeypatch.setattr(diagnostics_publisher, 'time', SimpleNamespace(monotonic=lambda: now[0]))
    b = bench().start()
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    b.other.destroy_publisher(b.source)
    b.until(lambda: b.statuses('waiting') and '0 publishers' in b.statuses('waiting')[-1].message)
    assert '/idem_node/source has 0 publishers' in b.statuses('waiting')[-1].message
    assert b.statuses('waiting')[-1].level == DiagnosticStatus.WARN
    now[0] += 6.0
    b.until(lambda: b.statuses('waiting')[-1].level == DiagnosticStatus.STALE)
    b.source = b.other.create_publisher(PointCloud2, '/idem_node/source', 10)
    b.until(b.source.get_subscription_count)
    send(b, clouds, FIRST + 100 * MS)
    found = matrix_of(b.transform_of(FIRST + 100 * MS))
    np.testing.assert_allclose(found, T_TRUTH, rtol=0, atol=0.02)
    assert stamps(b) == [FIRST, FIRST + 100 * MS]


def test_a_hundred_activations_under_load_lose_no_count_and_no_thread(bench, clouds):
    b = bench().start()
    registration = b.node.registration
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    threads = threading.active_count()
    pairing = registration.inputs.pairing
    source = cloud_message(clouds[1][:50], FIRST, 'lidar')
    for _ in range(100):
        for _ in range(2):
            for pair in pairing.add_source(source):
                registration.traffic.note_input('source', 0.0, None)
                registration.refining.submit(pair, None)
        registration.stop()
        registration.start()
    assert threading.active_count() == threads
    traffic = registration.traffic
    assert traffic.received == 201
    assert traffic.answered + traffic.refused + registration.dropped == 201
    send(b, clouds, FIRST + 100 * MS)
    b.transform_of(FIRST + 100 * MS)
