"""The registration node between the publishers and subscriptions of a test."""

from live import spin_until

# isort: split
import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float64

from idem_ros.core.geometry.se3 import exp, inverse, transform_points
from idem_ros.messages.transform_message import stamp_ns, translation_and_quaternion
from idem_ros.node.messages import cloud_message, time_message
from idem_ros.node.registration_node import RegistrationNode

MS = 10**6
FIRST = 1_700_000_000 * 10**9
T_TRUTH = exp(np.array([0.0, 0.0, 0.02, 0.2, -0.1, 0.05]))


def corner():
    """A corner of three noisy planes, and the same seen from T_TRUTH; as float32 holds them."""
    rng = np.random.default_rng(0)
    uv = rng.uniform(0, 4, (3, 400, 2))
    noise = rng.normal(0, 0.01, (3, 400, 1))
    target = np.concatenate(
        [
            np.insert(plane, [axis], n, axis=1)
            for axis, (plane, n) in enumerate(zip(uv, noise, strict=True))
        ]
    )
    source = target[rng.permutation(len(target))[:1000]] + rng.normal(0, 0.005, (1000, 3))
    clouds = target, transform_points(inverse(T_TRUTH), source)
    return [points.astype(np.float32).astype(np.float64) for points in clouds]


def guess_message(transform, stamp, frame_id='map', child_frame_id='lidar'):
    message = TransformStamped(child_frame_id=child_frame_id)
    message.header.frame_id = frame_id
    message.header.stamp = time_message(stamp)
    translation, quaternion = translation_and_quaternion(transform)
    t, q = message.transform.translation, message.transform.rotation
    t.x, t.y, t.z = translation
    q.x, q.y, q.z, q.w = quaternion
    return message


class Bench:
    """The node between publishers and subscriptions of a test."""

    def __init__(
        self,
        context,
        guess_type='transform',
        target_qos=10,
        guess_class=TransformStamped,
        **parameters,
    ):
        # the default is best effort, of which a test may not ask that all arrives
        quality = {'reliability': 'reliable', 'depth': 20}
        parameters = {**quality, 'initial_guess.type': guess_type, **parameters}
        self.overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        self.context, self.received = context, {'transform': [], 'q_tot': [], 'diagnostics': []}
        self.other = Node('other', context=context)
        self.target = self.other.create_publisher(PointCloud2, '/idem_node/target', target_qos)
        self.source = self.other.create_publisher(PointCloud2, '/idem_node/source', 10)
        self.guess = None
        if guess_class:
            self.guess = self.other.create_publisher(guess_class, '/idem_node/initial_guess', 10)
        for topic, kind in {
            '/idem_node/transform': TransformStamped,
            '/idem_node/q_tot': Float64,
            '/diagnostics': DiagnosticArray,
        }.items():
            kept = self.received[topic.rpartition('/')[2]]
            self.other.create_subscription(kind, topic, kept.append, 50)
        self.executor = SingleThreadedExecutor(context=context)
        self.executor.add_node(self.other)
        self.node, self.others = None, []

    def make_node(self, kind=RegistrationNode):
        self.node = kind(context=self.context, parameter_overrides=self.overrides)
        self.executor.add_node(self.node)
        return self.node

    def start(self):
        self.make_node()
        return self.connected()

    def connected(self):
        self.until(lambda: all(p.get_subscription_count() for p in self.publishers()))
        self.until(lambda: self.node.count_subscribers('/idem_node/transform'))
        return self

    def asked(self, kind, name, **request):
        """What a service of the node answers."""
        client = self.other.create_client(kind, f'/idem_node/{name}')
        self.until(client.service_is_ready)
        future = client.call_async(kind.Request(**request))
        self.until(future.done)
        return future.result()

    def publishers(self):
        return [each for each in (self.target, self.source, self.guess) if each]

    def until(self, condition):
        spin_until(self.executor, condition)

    def statuses(self, word):
        """The statuses whose value of `status` is a word, newest last."""
        every = [message.status[0] for message in self.received['diagnostics']]
        return [each for each in every if values_of(each).get('status') == word]

    def loads(self):
        """The statuses of the load, newest last."""
        every = [message.status[0] for message in self.received['diagnostics']]
        return [each for each in every if each.name.endswith(': load')]

    def transform_of(self, stamp):
        def found():
            return [m for m in self.received['transform'] if stamp_ns(m) == stamp]

        self.until(found)
        return found()[0]

    def close(self):
        self.executor.shutdown()
        for each in filter(None, (self.node, *self.others)):
            each.destroy_node()
        self.other.destroy_node()


def values_of(status):
    return {each.key: each.value for each in status.values}


def publish_clouds(bench, clouds, stamp):
    bench.target.publish(cloud_message(clouds[0], stamp - 10 * MS, 'map'))
    bench.source.publish(cloud_message(clouds[1], stamp, 'lidar'))


def send(bench, clouds, stamp, target=True):
    if target:
        bench.target.publish(cloud_message(clouds[0], stamp - 10 * MS, 'map'))
    bench.source.publish(cloud_message(clouds[1], stamp, 'lidar'))
    if bench.guess:
        bench.guess.publish(guess_message(np.eye(4), stamp))
