"""The node's diagnostics: of each result at once, and every second what it is doing."""

import time
from collections import deque

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

from idem_ros.node.console import Console
from idem_ros.node.interface import OUTPUTS
from idem_ros.node.messages import diagnostics_message
from idem_ros.node.traffic import Load
from idem_ros.refinement import diagnostics
from idem_ros.refinement.diagnostics import ERROR, OK, STALE, WARN
from idem_ros.refinement.outcome import Refinement

PERIOD = 1.0  # [s]
STALE_AFTER = 5.0  # [s] without a result or a refusal
KEPT = 10


class Report:
    """Publishes the statuses "registration" and "load", while it is on.

    Args:
        node: publishes.
        console: what an operator reads.

    Attributes:
        is_on: whether anything is published.
        lately: the last statuses, each as `diagnostics_message` takes it.
    """

    def __init__(self, node: Node, console: Console):
        self._node, self._console = node, console
        self._publisher = node.create_publisher(DiagnosticArray, OUTPUTS['diagnostics'].name, KEPT)
        self.is_on = False
        self.lately: deque[tuple] = deque(maxlen=KEPT)
        self._last: float | None = None
        self._reported_lately = False

    def close(self) -> None:
        """Destroy the publisher."""
        self._node.destroy_publisher(self._publisher)

    def result(self, refinement: Refinement, dropped: int) -> None:
        """Report a result."""
        values = diagnostics.refinement_values(refinement, dropped)
        text = diagnostics.message_of(refinement)
        self._event(diagnostics.level(refinement), text, values, refinement.stamp)

    def refused(self, reason: str, stamp: int, counts: dict[str, int]) -> None:
        """Report a source that was refused, by its stamp [ns]."""
        if self.is_on:
            self._console.refused(reason, time.monotonic())
        self._event(ERROR, reason, {'status': 'refused', 'reason': reason, **counts}, stamp)

    def clock_set_back(self, by: str, counts: dict[str, int]) -> None:
        """Report that a clock was set back."""
        reason = f'the clock was set back by {by}: what was buffered is forgotten'
        self._node.get_logger().warning(reason)
        values = {'status': 'clock_set_back', 'reason': reason, **counts}
        self._event(WARN, reason, values, self._now())

    def period(self, state: str, reason: str, counts: dict[str, int], load: Load) -> None:
        """Report what the node is doing, where nothing else was lately, and its load.

        Args:
            state: 'busy', 'paused' or 'waiting'.
            reason: the state in words.
            counts: to report with it.
            load: on the traffic.
        """
        if not self._reported_lately:
            values, level = {'status': state, 'reason': reason, **counts}, self._level_of(state)
            self._send('registration', level, reason, values, self._now())
            if level == STALE:
                self._console.waiting(reason, time.monotonic())
        self._reported_lately = False
        self._console.load(load.dropped, load.lost, load.share, time.monotonic())
        self._send('load', load.level, load.reason, load.values, self._now())

    def _level_of(self, state: str) -> int:
        if state == 'busy':
            return OK
        is_long_ago = self._last is None or time.monotonic() - self._last > STALE_AFTER
        return STALE if is_long_ago and state == 'waiting' else WARN

    def _event(self, level: int, text: str, values: dict, stamp: int) -> None:
        self._reported_lately, self._last = True, time.monotonic()
        self._send('registration', level, text, values, stamp)

    def _send(self, task: str, level: int, text: str, values: dict, stamp: int) -> None:
        if self.is_on:
            said = self._node.get_fully_qualified_name(), task, level, text, values, stamp
            self.lately.append(said)
            self._publisher.publish(diagnostics_message(*said))

    def _now(self) -> int:
        return self._node.get_clock().now().nanoseconds
