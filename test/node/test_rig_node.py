"""The node that watches a rig, between publishers and a listener to its diagnostics."""

import subprocess
import sys

import pytest
from live import LONG, own_environment, spin_until

# isort: split
import numpy as np
from clouds import motion
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rigs import SENSORS, extrinsics, sightings
from sensor_msgs.msg import PointCloud2

from idem_ros.calibration.sighting_messages import LiveRig
from idem_ros.core import InvalidConfig
from idem_ros.messages.transform_message import translation_and_quaternion
from idem_ros.node.messages import cloud_message
from idem_ros.node.rig_node import RigNode, Status

OK, WARN, ERROR, STALE = (bytes([level]) for level in range(4))
PERIOD_NS = 10**8
TOPICS = [f'/{name}/points' for name in SENSORS]
COVARIANCE = np.diag([1e-6] * 6).tolist()  # 1 mm, 0.06 deg


class Rig:
    """A rig whose sensors publish, and what the node says of it."""

    def __init__(self, context, rng, file, **parameters):
        self.rng, self.truth, self.file = rng, extrinsics(rng), file
        self.body = sightings(rng, self.truth)  # so that it seems to stand
        self.other = Node('drivers', context=context)
        self.publishers = [self.other.create_publisher(PointCloud2, each, 10) for each in TOPICS]
        self.statuses = []
        self.other.create_subscription(DiagnosticArray, '/diagnostics', self._add, 50)
        self.executor = SingleThreadedExecutor(context=context)
        self.executor.add_node(self.other)
        self.context, self.node, self.stamp = context, None, 10**9
        self.period = PERIOD_NS
        self.parameters = {
            'extrinsics': str(file),
            'topics': TOPICS,
            'period': 0.01,
            'instants': 1,
            'voxel_size': 0.05,
            'reliability': 'reliable',
            **parameters,
        }

    def write(self):
        """Write the extrinsics as `idem calibrate` does."""
        lines = ['sensors:']
        for name, T in zip(SENSORS, self.truth, strict=True):
            xyz, quaternion = (list(map(float, each)) for each in translation_and_quaternion(T))
            lines.append(f'  {name}: {{parent: {SENSORS[0]}, xyz: {xyz}, quaternion: {quaternion}')
            lines[-1] += f', covariance: {COVARIANCE}}}'
        self.file.write_text('\n'.join(lines))

    def start(self):
        overrides = [Parameter(name, value=value) for name, value in self.parameters.items()]
        self.node = RigNode(context=self.context, parameter_overrides=overrides)
        self.executor.add_node(self.node)
        self.until(lambda: all(each.get_subscription_count() for each in self.publishers))
        self.until(lambda: self.node.count_subscribers('/diagnostics'))

    def drive(self, poses, sensors=(0, 1, 2), clouds=6, frames=SENSORS):
        """Publish so many clouds of each of some sensors, which are at those poses."""
        for _ in range(clouds):
            (row,) = sightings(self.rng, poses, points=2000)
            for s in sensors:
                message = cloud_message(row[s], self.stamp, frames[s])
                self.publishers[s].publish(message)
            self.stamp += self.period

    def until(self, condition):
        spin_until(self.executor, condition)

    def status(self, level):
        """The newest status of a level, once there is one."""
        self.until(lambda: any(each.level == level for each in self.statuses))
        return [each for each in self.statuses if each.level == level][-1]

    def _add(self, message):
        self.statuses += message.status

    def close(self):
        self.executor.shutdown()
        for each in (self.node, self.other):
            if each is not None:
                each.destroy_node()


@pytest.fixture
def make_rig(context, rng, tmp_path):
    made = []

    def make(**parameters):
        made.append(Rig(context, rng, tmp_path / 'extrinsics.yaml', **parameters))
        made[-1].write()
        return made[-1]

    yield make
    for each in made:
        each.close()


def test_a_rig_as_it_was_calibrated_is_well(make_rig):
    rig = make_rig()
    rig.start()
    rig.drive(rig.truth)
    status = rig.status(OK)
    assert status.name == '/idem_rig_node: extrinsics'
    assert '3 sensors' in status.message
    values = {each.key: each.value for each in status.values}
    assert values['left: verdict'] == 'aligned'
    assert float(values['left: moved_m']) < 0.01


def test_a_sensor_that_was_knocked_is_named_with_how_far(make_rig):
    rig = make_rig()
    rig.start()
    knocked = rig.truth.copy()
    knocked[1] = rig.truth[1] @ motion(rig.rng, 3.0, 0.05)
    rig.drive(knocked)
    status = rig.status(WARN)
    assert 'left has moved by' in status.message
    assert 'right has moved' not in status.message
    values = {each.key: each.value for each in status.values}
    assert float(values['left: moved_deg']) == pytest.approx(3.0, abs=0.5)
    assert float(values['left: sigmas']) > 3.0
    assert float(values['right: sigmas']) < 3.0


def test_a_silent_sensor_is_named_and_the_others_are_watched(make_rig):
    rig = make_rig()
    rig.start()
    rig.drive(rig.truth, sensors=(0, 1))
    status = rig.status(WARN)
    assert status.message == '/right/points is silent'
    assert any(each.key == 'left: moved_m' for each in status.values)


def test_frames_that_the_extrinsics_do_not_know_are_named(make_rig):
    rig = make_rig()
    rig.file.write_text('sensors: {other: {parent: base, xyz: [0, 0, 1]}}')
    rig.start()
    rig.drive(rig.truth)
    assert "says nothing of the frame 'top'" in rig.status(ERROR).message


def test_without_clouds_it_says_what_it_waits_for(make_rig):
    rig = make_rig()
    rig.start()
    assert '/left/points has 1 publisher' in rig.status(STALE).message


@pytest.mark.parametrize(
    ('given', 'said'),
    [
        ({'topics': ['/top/points']}, 'two sensors at least'),
        ({'topics': ['/top/points'] * 2}, 'a topic of its own'),
        ({'extrinsics': ''}, 'idem calibrate --out'),
        ({'period': 0.0}, 'period'),
    ],
)
def test_what_names_no_rig_is_refused(make_rig, given, said):
    with pytest.raises(InvalidConfig, match=said):
        make_rig(**given).start()


def test_the_process_says_in_one_line_that_the_extrinsics_are_missing(tmp_path):
    code = 'import sys; from idem_ros.node import entry as r; sys.exit(r.main_rig())'
    given = f'extrinsics:={tmp_path / "none.yaml"}', 'topics:=[/a, /b]'
    command = [sys.executable, '-c', code, '--ros-args', '-p', given[0], '-p', given[1]]
    ended = subprocess.run(
        command, env=own_environment(), capture_output=True, text=True, timeout=LONG
    )
    assert ended.returncode == 2
    (line,) = ended.stderr.splitlines()
    assert line.startswith('idem_rig_node: error: ')
    assert 'none.yaml' in line


def test_what_changes_is_said_whether_it_is_good_news_or_bad(make_rig, capfd):
    rig = make_rig()
    rig.start()
    for status in (
        Status(0, 'all well', {}),
        Status(1, 'left has moved by 0.05 m', {}, ('left has moved by 0.05 m',)),
        Status(1, 'left has moved by 0.06 m', {}, ('left has moved by 0.06 m',)),
        Status(0, 'well again', {}),
    ):
        rig.node._publish(status, 0)
    said = [line.rpartition(': ')[2] for line in capfd.readouterr().err.splitlines()]
    assert said[-3:] == ['all well', 'left has moved by 0.05 m', 'well again']


def test_stamps_that_do_not_increase_are_named(make_rig):
    rig = make_rig()
    rig.stamp = rig.period = 0
    rig.start()
    rig.drive(rig.truth)
    rig.until(lambda: rig.node._live.flaws())
    rig.statuses.clear()
    assert '/top/points has clouds whose stamps do not increase' in rig.status(STALE).message


def test_sensors_that_share_a_frame_are_named(make_rig):
    rig = make_rig()
    rig.start()
    rig.drive(rig.truth, frames=('top', 'left', 'left'))
    assert "2 topics are in the frame 'left'" in rig.status(ERROR).message


def test_a_sensor_that_cannot_be_heard_is_named_with_the_remedy(make_rig):
    rig = make_rig()
    rig.other.destroy_publisher(rig.publishers.pop())
    unheard = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
    rig.other.create_publisher(PointCloud2, TOPICS[2], unheard)
    rig.start()
    rig.drive(rig.truth, sensors=(0, 1))
    message = rig.status(WARN).message
    assert message.startswith('/right/points is silent: /drivers offers best_effort')
    assert message.endswith('set reliability to best_effort')


def test_an_error_nobody_foresaw_is_a_status_and_the_next_instant_is_taken(make_rig):
    rig = make_rig()
    rig.start()
    take = rig.node._watch.take
    rig.node._watch.take = lambda *given: 1 / 0
    rig.drive(rig.truth)
    assert 'ZeroDivisionError' in rig.status(ERROR).message
    rig.node._watch.take = take
    rig.drive(rig.truth)
    rig.status(OK)


def test_a_sensor_of_another_clock_or_that_has_stopped_is_told_by_how_much():
    rig = LiveRig(3)
    for k in range(26):
        for sensor, offset in enumerate((0, 0, 3600 * 10**9)):
            if sensor != 1 or k == 0:
                rig.add(sensor, cloud_message(np.ones((1, 3)), k * PERIOD_NS + offset, 'lidar'))
    stopped, other = rig.flaws()[1], rig.flaws()[2]
    assert stopped.startswith('is 2.5 s behind the reference: it has stopped')
    assert other.startswith('is 3.6e+03 s ahead of the reference')
