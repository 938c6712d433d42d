"""What the node publishes of its pairs: of each its result, or why it was refused, once."""

import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from idem_ros.core import Status
from idem_ros.messages.stamps import seconds
from idem_ros.node.capsules import Capsules
from idem_ros.node.config import ALIGNED, OutputConfig
from idem_ros.node.console import Console
from idem_ros.node.control import Answer, what_came_of
from idem_ros.node.diagnostics_publisher import Report
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
from idem_ros.node.refining import Job
from idem_ros.node.traffic import Load, Traffic
from idem_ros.node.unforeseen import AGAIN, reason_of
from idem_ros.pairing.pair import Refusal
from idem_ros.refinement.debug_clouds import (
    QTotSlice,
    aligned_points,
    points_of,
    points_with_q,
    slice_of,
)
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


class Publishing:
    """Publishes results and refusals from when it is made until `close`, reports while it is on.

    Args:
        node: publishes.
        config: `OutputConfig`.
        traffic: counts what is answered and refused.
        console: what an operator reads.
        capsules: keeps what went wrong.
        counts: returns what is reported with everything: 'dropped' and 'clock_jumps'.

    Raises:
        InvalidConfig: the messages of /tf are needed and not installed.
    """

    def __init__(
        self,
        node: Node,
        config: OutputConfig,
        traffic: Traffic,
        console: Console,
        capsules: Capsules,
        counts: Callable[[], dict[str, int]],
    ):
        self._node, self._traffic, self._counts = node, traffic, counts
        self._console, self._capsules = console, capsules
        self._outputs, self._report = Outputs(node, config), Report(node, console)
        self._last: Refinement | None = None

    def configure(self, config: OutputConfig) -> None:
        """Publish by other parameters from now on."""
        self._outputs.configure(config)

    def turn(self, is_on: bool) -> None:
        """Report from now on, or no longer."""
        self._report.is_on = is_on

    def close(self) -> None:
        """Destroy the publishers."""
        self._outputs.close()
        self._report.close()

    def result(self, job: Job, refinement: Refinement) -> Answer:
        """Publish what came of a pair."""
        answer = what_came_of(refinement)
        if not self._node.context.ok():
            return answer
        self._outputs.publish(refinement)
        if not job.is_settled:
            now = time.monotonic()
            self._traffic.note_answer(now, job.received and now - job.received)
            self._console.result(refinement, now)
        job.is_settled, self._last = True, refinement
        self._report.result(refinement, self._counts()['dropped'])
        self._capsules.offer(job.pair, refinement, '', self._report.lately)
        try:
            self._outputs.publish_debug(refinement)
        except Exception as error:  # the pair was answered: it is no refusal
            log = self._node.get_logger()
            log.error(reason_of(error, log), throttle_duration_sec=AGAIN)
        return answer

    def refusal(self, job: Job, error: Exception) -> Answer:
        """Report why nothing came of a pair."""
        if not self._node.context.ok():  # shutting down; publishing is what failed
            return Answer(False, f'refused: {reason_of(error)}')
        reason = reason_of(error, self._node.get_logger())
        self._traffic.refused += not job.is_settled
        self._report.refused(reason, job.pair.stamp, self._counts())
        self._capsules.offer(job.pair, None, reason, self._report.lately)
        return Answer(False, f'refused: {reason}')

    def refused_input(self, refusal: Refusal) -> None:
        """Report an input that no pair is made of."""
        self._report.refused(refusal.reason, refusal.stamp, self._counts())

    def clock_set_back(self, by: int) -> None:
        """Report that a clock was set back, by so much [ns]."""
        self._report.clock_set_back(seconds(by), self._counts())

    def period(self, state: str, reason: str, load: Load) -> None:
        """Report what the node is doing, see `Report.period`."""
        self._report.period(state, reason, self._counts(), load)

    def region(self) -> Answer:
        """Evaluate q_tot around the last result, and publish it."""
        if self._last is None:
            return Answer(False, 'there is no result yet')
        slice_ = slice_of(self._last)
        self._outputs.publish_region(self._last, slice_)
        return Answer(True, str(slice_))
