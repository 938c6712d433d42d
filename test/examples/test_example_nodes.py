from live import own_graph, spin_until

# isort: split
import importlib.util
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TransformStamped
from node_bench import T_TRUTH
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float64

from idem_ros.messages.transform_message import matrix_of
from idem_ros.node.messages import cloud_message

EXAMPLES = Path(__file__).resolve().parents[2] / 'examples'


def example(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f'{name}.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def graph():
    """An executor with a node of the test's own, and what makes room for others in it."""
    with own_graph() as context:
        executor = SingleThreadedExecutor(context=context)
        nodes = [Node('other', context=context)]
        executor.add_node(nodes[0])

        def joined(kind):
            nodes.append(kind(context=context))
            executor.add_node(nodes[-1])
            return nodes[-1]

        yield executor, nodes[0], joined
        executor.shutdown()
        for node in nodes:
            node.destroy_node()


def statuses(verdict):
    values = [KeyValue(key='verdict', value=verdict), KeyValue(key='verdict_reason', value='so')]
    status = DiagnosticStatus(name='/idem_node: registration', values=values)
    return DiagnosticArray(status=[DiagnosticStatus(name='/idem_node: load'), status])


def test_the_robot_slows_down_in_doubt_stops_after_some_and_goes_on_once_it_is_aligned(graph):
    executor, other, joined = graph
    module = example('act_on_the_verdict')
    limits = []
    joined(module.SpeedByVerdict)
    other.create_subscription(Float64, 'speed_limit', lambda said: limits.append(said.data), 10)
    sent = other.create_publisher(DiagnosticArray, '/diagnostics', 10)
    spin_until(
        executor, lambda: sent.get_subscription_count() and other.count_publishers('speed_limit')
    )
    for verdict in ['aligned', *['misaligned'] * module.PATIENCE, 'aligned']:
        before = len(limits)
        sent.publish(statuses(verdict))
        spin_until(executor, lambda before=before: len(limits) > before)
    careful = [module.CAREFUL] * (module.PATIENCE - 1)
    assert limits == [module.FULL, *careful, module.STOP, module.FULL]


def test_a_node_of_ones_own_sends_the_motion_between_two_scans(graph, clouds):
    executor, other, joined = graph
    motions = []
    joined(example('own_node').ScanOdometry)
    other.create_subscription(TransformStamped, 'motion', motions.append, 10)
    sent = other.create_publisher(PointCloud2, 'points', 10)
    spin_until(
        executor, lambda: sent.get_subscription_count() and other.count_publishers('motion')
    )
    for stamp, points in enumerate(clouds):
        sent.publish(cloud_message(points, stamp, 'lidar'))
    spin_until(executor, lambda: motions)
    (motion,) = motions
    assert (motion.header.frame_id, motion.child_frame_id) == ('lidar', 'lidar_now')
    assert np.allclose(matrix_of(motion), T_TRUTH, atol=5e-3)
