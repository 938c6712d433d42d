"""The node in this process: poses in every form, tf, clouds to look at, the region of interest."""

from importlib.util import find_spec
from types import SimpleNamespace

import pytest
from node_bench import FIRST, MS, cloud_message, send, values_of

# isort: split
import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from rclpy.parameter import Parameter
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger

from idem_ros.core import InvalidConfig
from idem_ros.core.geometry.se3 import transform_points
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.node import outputs
from idem_ros.refinement.debug_clouds import points_with_q


def subscribed(bench, kind, topic):
    received = []
    topic = f'/idem_node/{topic}'
    bench.other.create_subscription(kind, topic, received.append, 10)
    bench.until(lambda: bench.node.count_subscribers(topic))
    return received


def test_pose_with_covariance_is_the_transform_at_the_same_stamp(bench, clouds):
    b = bench().start()
    poses = subscribed(b, PoseWithCovarianceStamped, 'pose_with_covariance')
    send(b, clouds, FIRST)
    transform = b.transform_of(FIRST)
    b.until(lambda: poses)
    assert stamp_ns(poses[0]) == FIRST
    assert poses[0].header.frame_id == 'map'
    np.testing.assert_allclose(matrix_of(poses[0]), matrix_of(transform), rtol=0, atol=1e-12)
    variances = np.diag(poses[0].pose.covariance.reshape(6, 6))
    assert (variances > 0).all()
    assert (variances < 0.1**2).all()


def test_an_auditor_publishes_the_verdict_and_no_pose(bench, clouds):
    b = bench(mode='audit').start()
    poses = subscribed(b, PoseWithCovarianceStamped, 'pose_with_covariance')
    send(b, clouds, FIRST)
    b.until(lambda: b.statuses('audited'))
    (status,) = b.statuses('audited')
    values = values_of(status)
    assert values['verdict'] == 'misaligned'  # the guess is the identity
    assert float(values['p_aligned']) < 0.5
    assert status.level == DiagnosticStatus.ERROR
    assert values['q_tot']
    assert not poses
    assert not b.received['transform']


@pytest.mark.skipif(find_spec('tf2_msgs') is not None, reason='tf2_msgs is installed here')
def test_tf_output_without_its_messages_ends_the_start_or_refuses_the_change(bench):
    with pytest.raises(InvalidConfig, match='publish_tf is true.*apt install ros-jazzy-tf2-msgs'):
        bench(publish_tf=True).start()
    b = bench().start()
    (result,) = b.node.set_parameters([Parameter('publish_tf', value=True)])
    assert not result.successful
    assert 'tf2_msgs' in result.reason


@pytest.fixture
def broadcast(monkeypatch):
    """What a node broadcasts, where no package has the messages of tf: records stand for them."""
    sent = []

    class Broadcaster(outputs.Outputs):
        def __init__(self, node, config):
            real = node.create_publisher
            node.create_publisher = lambda kind, name, kept: (
                SimpleNamespace(publish=sent.append) if name == '/tf' else real(kind, name, kept)
            )
            super().__init__(node, config)

    monkeypatch.setattr(outputs, '_tf_class', lambda: SimpleNamespace)
    monkeypatch.setattr('idem_ros.node.outputs.Outputs', Broadcaster)
    return sent


def test_tf_has_what_the_transform_says_and_only_where_it_converged(bench, clouds, broadcast):
    b = bench(publish_tf=True).start()
    send(b, clouds, FIRST)
    transform = b.transform_of(FIRST)
    b.until(lambda: broadcast)
    assert [message.transforms for message in broadcast] == [[transform]]
    b.node.set_parameters([Parameter('max_iterations', value=1)])
    send(b, clouds, FIRST + 100 * MS)
    b.transform_of(FIRST + 100 * MS)
    b.until(lambda: b.statuses('max_iterations'))
    assert len(broadcast) == 1


def test_where_only_what_is_aligned_is_asked_for_nothing_else_is_published(bench, clouds):
    b = bench(publish='aligned').start()
    poses = subscribed(b, PoseWithCovarianceStamped, 'pose_with_covariance')
    for i, steps in enumerate((1, 50)):
        b.node.set_parameters([Parameter('max_iterations', value=steps)])
        send(b, clouds, FIRST + i * 100 * MS)
        b.until(lambda count=i + 1: len(b.received['q_tot']) == count)
    b.transform_of(FIRST + 100 * MS)
    assert len(b.received['transform']) == 1
    b.until(lambda: [stamp_ns(pose) for pose in poses] == [FIRST + 100 * MS])
    b.until(lambda: b.statuses('max_iterations'))


def test_frames_are_published_without_the_slash_that_ros_1_began_them_with(bench, clouds):
    b = bench(guess_type='identity', guess_class=None).start()
    b.target.publish(cloud_message(clouds[0], FIRST - 10 * MS, '/map'))
    b.source.publish(cloud_message(clouds[1], FIRST, '/lidar'))
    message = b.transform_of(FIRST)
    assert (message.header.frame_id, message.child_frame_id) == ('map', 'lidar')


def test_a_transform_of_a_frame_to_itself_is_not_broadcast(bench, clouds, broadcast):
    b = bench(guess_type='identity', guess_class=None, publish_tf=True).start()
    b.target.publish(cloud_message(clouds[0], FIRST - 10 * MS, 'lidar'))
    b.source.publish(cloud_message(clouds[1], FIRST, '/lidar'))
    b.transform_of(FIRST)
    b.until(lambda: b.statuses('converged'))
    assert broadcast == []


def test_tf_may_be_switched_on_and_off_while_it_runs(bench, clouds, broadcast):
    b = bench().start()
    counts = []
    for i, value in enumerate((False, True, False)):
        b.node.set_parameters([Parameter('publish_tf', value=value)])
        stamp = FIRST + i * 100 * MS
        send(b, clouds, stamp)
        b.transform_of(stamp)
        b.until(lambda count=i + 1: len(b.statuses('converged')) == count)
        counts.append(len(broadcast))
    assert counts == [0, 1, 1]


def test_clouds_to_look_at_are_made_while_somebody_subscribes_only(bench, clouds, monkeypatch):
    made = []
    monkeypatch.setattr(
        outputs, 'points_with_q', lambda *given: made.append(1) or points_with_q(*given)
    )
    b = bench().start()
    send(b, clouds, FIRST)
    b.until(lambda: b.statuses('converged'))
    assert made == []
    q_points = subscribed(b, PointCloud2, 'debug/q_points')
    send(b, clouds, FIRST + 100 * MS)
    b.until(lambda: q_points)
    assert made == [1]


def test_aligned_cloud_and_shares_of_q_tot_are_in_the_target_frame(bench, clouds):
    b = bench().start()
    aligned = subscribed(b, PointCloud2, 'debug/aligned')
    q_points = subscribed(b, PointCloud2, 'debug/q_points')
    send(b, clouds, FIRST)
    T = matrix_of(b.transform_of(FIRST))
    b.until(lambda: aligned and q_points and b.statuses('converged'))
    for message in (aligned[0], q_points[0]):
        assert (message.header.frame_id, stamp_ns(message)) == ('map', FIRST)
    moved = transform_points(T, clouds[1])
    np.testing.assert_allclose(read_points(aligned[0]).points, moved, rtol=0, atol=1e-6)
    rows = np.frombuffer(q_points[0].data, '<f4').reshape(-1, 5)
    assert [field.name for field in q_points[0].fields] == ['x', 'y', 'z', 'q_i', 'cloud']
    assert len(rows) == len(clouds[0]) + len(clouds[1])
    q_tot = float(values_of(b.statuses('converged')[0])['q_tot'])
    assert rows[:, 3].sum(dtype=float) == pytest.approx(q_tot, rel=1e-4)


def test_error_in_a_cloud_to_look_at_is_no_refusal_of_a_pair_that_was_answered(
    bench, clouds, monkeypatch
):
    monkeypatch.setattr(outputs, 'aligned_points', lambda *given: 1 / 0)
    b = bench().start()
    subscribed(b, PointCloud2, 'debug/aligned')
    for i in range(2):
        send(b, clouds, FIRST + i * 100 * MS)
        b.transform_of(FIRST + i * 100 * MS)
    b.until(lambda: len(b.statuses('converged')) == 2)
    assert b.statuses('refused') == []


def test_region_of_interest_is_published_on_request_around_the_last_result(bench, clouds):
    b = bench(voxel_size=0.3).start()
    grids = subscribed(b, OccupancyGrid, 'debug/region_of_interest')
    early = b.asked(Trigger, 'publish_region_of_interest')
    assert (early.success, early.message) == (False, 'there is no result yet')
    send(b, clouds, FIRST)
    T = matrix_of(b.transform_of(FIRST))
    answer = b.asked(Trigger, 'publish_region_of_interest')
    assert answer.success
    assert 'nat (100) on 25 x 25 cells' in answer.message
    b.until(lambda: grids)
    (grid,) = grids
    assert (grid.header.frame_id, stamp_ns(grid)) == ('map', FIRST)
    assert (min(grid.data), max(grid.data)) == (0, 100)
    middle = grid.info.origin.position.x + grid.info.resolution * grid.info.width / 2
    assert middle == pytest.approx(T[0, 3], abs=1e-6)


def test_load_is_reported_every_second_and_every_source_accounted_for(bench, clouds):
    b = bench().start()
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    b.until(lambda: any(values_of(each).get('answered') == '1' for each in b.loads()))
    load = b.loads()[-1]
    values = values_of(load)
    assert load.level == DiagnosticStatus.OK
    assert (values['received'], values['dropped'], values['waiting']) == ('1', '0', '0')
    assert 0.0 < float(values['utilisation']) <= 1.0
    assert float(values['receipt_to_publication_s']) > 0.0
    assert 'set use_sim_time' in load.message  # the stamps are of 2023
    count = len(b.loads())
    b.until(lambda: len(b.loads()) > count)  # although nothing comes
