"""Publishes a recording on live topics, message by message, at the pace it was recorded."""

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import rclpy
from rclpy.duration import Duration
from rclpy.exceptions import NameValidationException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from rosgraph_msgs.msg import Clock

from idem_ros.core import IdemError
from idem_ros.node.environment import logging_arguments
from idem_ros.node.messages import message_class, time_message
from idem_ros.recording.decoding import UnreadableTopic
from idem_ros.recording.messages import NotSendable, is_known, to_cdr
from idem_ros.recording.reader import Recording
from idem_ros.terminal.printable import error_line

CLOCK = '/clock'
KEPT = 10  # messages of a topic that are sent again until every subscriber has them
POLL = 0.05  # [s]


class NothingToPlay(IdemError):
    """A recording of which no topic can be published."""


class Player:
    """Publishers for the topics of a recording.

    All are reliable. A topic that holds one message, or whose name ends in 'target', is latched
    (transient local), so that a map reaches those who subscribe later.

    Args:
        node: publishes.
        recording: open; its messages are handed to `publish` one by one.
        topics: names of the topics to publish; None: all.
        with_clock: also publish each log time on /clock.

    Attributes:
        skipped: {topic: why it is not published}; `publish` may add to it.

    Raises:
        NothingToPlay: not one topic can be published.
    """

    def __init__(
        self,
        node: Node,
        recording: Recording,
        topics: list[str] | None = None,
        with_clock: bool = False,
    ):
        self.skipped: dict[str, str] = {}
        self._publishers: dict[str, Publisher] = {}
        self._heard: set[str] = set()
        self._clock = node.create_publisher(Clock, CLOCK, KEPT) if with_clock else None
        for name in recording.topics if topics is None else topics:
            try:
                self._publishers[name] = self._open(node, recording, name)
            except (NotSendable, UnreadableTopic, ImportError, NameValidationException) as error:
                self.skipped[name] = error_line(error)
        if not self._publishers:
            reasons = '; '.join(f'{name}: {reason}' for name, reason in self.skipped.items())
            raise NothingToPlay(
                f'{recording.path} holds no topic that can be published: {reasons or "no topic"}'
            )

    @property
    def topics(self) -> list[str]:
        """Names of the topics that are published, as in the recording."""
        return list(self._publishers)

    def is_heard(self) -> bool:
        """Whether every topic has a subscriber."""
        return all(each.get_subscription_count() for each in self._publishers.values())

    def unheard(self) -> list[str]:
        """Return the topics that had no subscriber at any of their messages, and have none now."""
        for name in self._publishers:
            self._note_whether_heard(name)
        return [name for name in self._publishers if name not in self._heard]

    def subscribers(self) -> int:
        """How many subscriptions are matched, over all topics."""
        return sum(each.get_subscription_count() for each in self._publishers.values())

    def wait_for_subscribers(self, patience: float, settling: float = 0.5) -> bool:
        """Wait until somebody listens and for `settling` [s] nobody joined, or for `patience` [s].

        Returns:
            Whether anybody listens.
        """
        end = time.monotonic() + patience
        heard, since = 0, time.monotonic()
        while (now := time.monotonic()) < end and not (heard and now - since >= settling):
            count = self.subscribers()
            if count != heard:
                heard, since = count, now
            time.sleep(POLL)
        return heard > 0

    def publish(self, topic: str, log_time: int, message: Any) -> bool:
        """Publish one message of the recording; return False where its topic is skipped.

        Args:
            topic: its name in the recording.
            log_time: [ns], published on /clock first where that was asked for.
            message: as the recording gives it.
        """
        if topic not in self._publishers:
            return False
        try:
            cdr = to_cdr(message)
        except NotSendable as error:
            self.skipped[topic] = str(error)
            del self._publishers[topic]
            return False
        if self._clock is not None:
            self._clock.publish(Clock(clock=time_message(log_time)))
        self._publishers[topic].publish(cdr)
        self._note_whether_heard(topic)
        return True

    def finish(self, patience: float) -> bool:
        """Wait up to `patience` [s] until subscribers have everything; return whether they do."""
        end = time.monotonic() + patience
        return all(
            each.wait_for_all_acked(Duration(seconds=max(end - time.monotonic(), 0.0)))
            for each in self._publishers.values()
        )

    def _note_whether_heard(self, name: str) -> None:
        if name not in self._heard and self._publishers[name].get_subscription_count():
            self._heard.add(name)

    def _open(self, node: Node, recording: Recording, name: str) -> Publisher:
        topic = recording.topics[name]
        if self._clock is not None and name.lstrip('/') == CLOCK.lstrip('/'):
            raise NotSendable('the log times are published on /clock instead')
        if not is_known(topic.msgtype):
            raise NotSendable(f'{topic.msgtype} is no type of ROS 2 Jazzy')
        recording.require_readable(name)
        is_latched = topic.count == 1 or name.endswith('target')
        durability = DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE
        quality = QoSProfile(depth=KEPT, durability=durability)
        return node.create_publisher(message_class(topic.msgtype), name, quality)


class Pace:
    """Holds back each message until its time has come.

    Args:
        rate: of the recording's time over real time.
    """

    def __init__(self, rate: float):
        self._rate = rate
        self._start: tuple[int, float] | None = None

    def wait(self, log_time: int) -> None:
        """Sleep until a message logged at `log_time` [ns] is due; the first one is at once."""
        if self._start is None:
            self._start = (log_time, time.monotonic())
        first, start = self._start
        due = start + (log_time - first) / 1e9 / self._rate
        time.sleep(max(due - time.monotonic(), 0.0))


@contextmanager
def playing_node(name: str) -> Iterator[Node]:
    """Yield a node in a session of rclpy of its own.

    Raises:
        SystemExit: on SIGINT (130) and SIGTERM (143), wherever the block is, so that what it
            opened is closed in order.
    """

    def end(signum, frame):
        # no KeyboardInterrupt: after one raised in exec(), and rosbags compiles its serialisers,
        # CPython ends itself by SIGINT even where it was caught
        raise SystemExit(128 + signum)

    before = {signum: signal.signal(signum, end) for signum in (signal.SIGINT, signal.SIGTERM)}
    rclpy.init(args=logging_arguments(), signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Node(name)
        yield node
        node.destroy_node()
    finally:
        rclpy.try_shutdown()  # pyright: ignore[reportPrivateImportUsage]
        for signum, previous in before.items():
            signal.signal(signum, previous or signal.SIG_DFL)
