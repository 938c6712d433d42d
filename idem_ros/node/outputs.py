"""What the node publishes of a refinement."""

from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from idem_ros.core import Status
from idem_ros.node.config import ALIGNED, OutputConfig
from idem_ros.node.interface import OUTPUTS, TF_OUTPUT
from idem_ros.node.messages import (
    class_needed,
    cloud_message,
    grid_message,
    message_class,
    pose_message,
    q_tot_message,
    transform_message,
)
from idem_ros.refinement.debug_clouds import QTotSlice, aligned_points, points_of, points_with_q
from idem_ros.refinement.outcome import Refinement

RESULTS_KEPT = 10
SAID_AGAIN = 60.0  # [s], on the console
TRANSFORMS_KEPT = 100  # as tf2 has it
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
NAMES = tuple(name for name in OUTPUTS if name != 'diagnostics')


class Outputs:
    """The publishers of results; used from the worker's thread, but for `configure`.

    Args:
        node: publishes.
        config: `OutputConfig`.

    Raises:
        InvalidConfig: the messages of /tf are needed and not installed.
    """

    def __init__(self, node: Node, config: OutputConfig):
        self._node = node
        self._tf: Any = None  # class and publisher, once asked for
        self._publishers = {
            name: node.create_publisher(
                message_class(OUTPUTS[name].msgtype),
                OUTPUTS[name].name,
                LATCHED if name == 'region_of_interest' else RESULTS_KEPT,
            )
            for name in NAMES
        }
        self.configure(config)

    def configure(self, config: OutputConfig) -> None:
        """Broadcast on /tf from now on, or no longer."""
        self._config = config
        if config.publish_tf and self._tf is None:
            tf_class = _tf_class()
            publisher = self._node.create_publisher(tf_class, TF_OUTPUT.name, TRANSFORMS_KEPT)
            self._tf = tf_class, publisher

    def close(self) -> None:
        """Destroy the publishers."""
        publishers = [*self._publishers.values(), *([self._tf[1]] if self._tf else [])]
        for publisher in publishers:
            self._node.destroy_publisher(publisher)

    def publish(self, refinement: Refinement) -> None:
        """Publish the pose in its forms, as far as it is asked for, and q_tot.

        Of a pose that was audited it is q_tot alone.
        """
        is_wanted = refinement.result.is_usable or self._config.publish != ALIGNED
        if refinement.result.status is not Status.AUDITED and is_wanted:
            self._publish_pose(refinement)  # first: somebody waits for it
        self._publishers['q_tot'].publish(q_tot_message(refinement))

    def _publish_pose(self, refinement: Refinement) -> None:
        said = refinement.result.assessment
        transform = transform_message(refinement)
        self._publishers['transform'].publish(transform)
        pose = pose_message(refinement, covariance=said.covariance if said else None)
        self._publishers['pose_with_covariance'].publish(pose)
        if self._config.publish_tf and refinement.result.is_usable:
            self._broadcast(transform)

    def _broadcast(self, transform) -> None:
        frames = transform.header.frame_id, transform.child_frame_id
        if not all(frames) or frames[0] == frames[1]:
            self._node.get_logger().warning(
                f'not broadcast on /tf: the frame of the target is {frames[0]!r}, that of the '
                f'source {frames[1]!r}; they must be two',
                throttle_duration_sec=SAID_AGAIN,
            )
            return
        tf_class, publisher = self._tf
        publisher.publish(tf_class(transforms=[transform]))

    def publish_debug(self, refinement: Refinement) -> None:
        """Make the clouds that somebody subscribes to, and publish them."""
        T, took_part = refinement.result.T_target_source, refinement.took_part
        assert took_part is not None, 'of a result that was just found'
        header = refinement.instant, refinement.target_frame
        if self._is_wanted('aligned'):
            points = aligned_points(T, took_part.source)
            self._publishers['aligned'].publish(cloud_message(points, *header))
        if self._is_wanted('undistorted') and refinement.result.twist is not None:
            points, frame = points_of(took_part.source), refinement.source_frame
            message = cloud_message(points, refinement.instant, frame)
            self._publishers['undistorted'].publish(message)
        if self._is_wanted('q_points'):
            points, q, cloud = points_with_q(refinement.result, *took_part)
            message = cloud_message(points, *header, columns={'q_i': q, 'cloud': cloud})
            self._publishers['q_points'].publish(message)

    def publish_region(self, refinement: Refinement, slice_: QTotSlice) -> None:
        """Publish a slice of q_tot around a result; who subscribes later gets it, too."""
        self._publishers['region_of_interest'].publish(grid_message(refinement, slice_))

    def _is_wanted(self, name: str) -> bool:
        return self._publishers[name].get_subscription_count() > 0


def require_outputs(config: OutputConfig) -> None:
    """Refuse a configuration whose messages are not installed.

    Raises:
        InvalidConfig: it says what to install.
    """
    if config.publish_tf:
        _tf_class()


def _tf_class() -> type:
    return class_needed(TF_OUTPUT.msgtype, 'publish_tf is true')
