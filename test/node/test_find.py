from live import spin_until

# isort: split
import threading

import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from node_bench import FIRST, cloud_message, guess_message
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import PointCloud2

from idem_ros.node.find import Heard, find, proposal, told
from idem_ros.pairing.guesses import STREAMED, TF

CLOUD = 'sensor_msgs/msg/PointCloud2'
MAP = Heard('/map', CLOUD, True, 1, ('map', ''), 9000)
SCANS = Heard('/points', CLOUD, False, 30, ('lidar', ''), 3000)


def test_what_is_published_is_heard_with_its_frames(context, clouds):
    other = Node('robot', context=context)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    a_map = other.create_publisher(PointCloud2, '/a_map', latched)
    a_map.publish(cloud_message(clouds[0], FIRST, 'map'))
    scans = other.create_publisher(PointCloud2, '/scans', 10)
    poses = other.create_publisher(TransformStamped, '/pose', 10)

    def publish():
        scans.publish(cloud_message(clouds[1], FIRST, 'lidar'))
        poses.publish(guess_message(np.eye(4), FIRST))

    other.create_timer(0.1, publish)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(other)
    ended = threading.Event()
    thread = threading.Thread(target=lambda: spin_until(executor, ended.is_set))
    thread.start()
    finder = Node('idem_find', context=context)
    try:
        heard = {each.topic: each for each in find(finder, 3.0)}
    finally:
        ended.set()
        thread.join()
        executor.shutdown()
        finder.destroy_node()
        other.destroy_node()
    assert heard['/a_map'].is_latched
    assert heard['/a_map'].points == len(clouds[0])
    assert heard['/scans'].frames == ('lidar', '')
    assert heard['/pose'].frames == ('map', 'lidar')
    assert proposal(list(heard.values())) == (
        "idem_node --ros-args -r '~/target:=/a_map' -r '~/source:=/scans' "
        "-r '~/initial_guess:=/pose' -p initial_guess.type:=transform"
    )
    assert '| /scans' in told(list(heard.values()), 3.0)


def test_tf_that_leads_from_the_map_to_the_sensor_is_preferred():
    tf = Heard('/tf', TF, False, 9, edges={('map', 'base'), ('base', 'lidar')})
    odometry = Heard('/odom', STREAMED['odometry'], False, 9, ('odom', 'base'))
    assert proposal([MAP, SCANS, odometry, tf]).endswith('-p initial_guess.type:=tf')


def test_a_pose_in_the_frame_of_the_map_is_taken_and_one_in_another_is_not():
    kind = STREAMED['pose_with_covariance']
    fits, other = (Heard(f'/{f}', kind, False, 9, (f, '')) for f in ('map', 'earth'))
    assert "-r '~/initial_guess:=/map' -p initial_guess.type:=pose_with_covariance" in proposal(
        [MAP, SCANS, other, fits]
    )
    assert proposal([MAP, SCANS, other]).endswith('-p initial_guess.type:=last')


def test_what_is_called_a_guess_comes_before_others_and_a_truth_last():
    kind = STREAMED['transform']
    truth, pose, guess = (
        Heard(topic, kind, False, 9, ('map', 'lidar'))
        for topic in ('/ground_truth', '/pose', '/initial_guess')
    )
    assert '/initial_guess:=/initial_guess' in proposal([MAP, SCANS, truth, pose, guess])
    assert '/initial_guess:=/pose' in proposal([MAP, SCANS, truth, pose])


def test_of_scans_alone_each_is_registered_to_the_one_before():
    assert "-r '~/target:=/points' -r '~/source:=/points'" in proposal([SCANS])


@pytest.mark.parametrize('heard', [[], [Heard('/silent', CLOUD, False)]])
def test_without_a_cloud_nothing_is_proposed(heard):
    assert proposal(heard) == ''
    assert 'no cloud is published' in told(heard, 3.0)
