"""Tells when a node's clock was set back, unless it jumps about, or stands still."""

import time
from collections.abc import Callable
from typing import Any

from rclpy.clock import JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.node import Node

STEADY = 1.0  # [s] a clock that is set back sooner again tells nothing; sources then do


class ClockWatch:
    """Watches the clock of a node, until it is closed.

    Args:
        node: its clock is that of the simulation where it uses simulated time.
        on_set_back: called with the time [ns] that it was set back to.
    """

    def __init__(self, node: Node, on_set_back: Callable[[int], None]):
        self._clock, self._on_set_back = node.get_clock(), on_set_back
        self._last = float('-inf')  # when it was set back, of time.monotonic
        backwards = JumpThreshold(
            min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=False
        )
        self._handle = self._clock.create_jump_callback(backwards, post_callback=self._on_jump)

    def close(self) -> None:
        """Watch no longer."""
        self._handle.unregister()

    def _on_jump(self, jump: TimeJump) -> None:
        before, self._last = self._last, time.monotonic()
        if self._last - before > STEADY:
            self._on_set_back(self._clock.now().nanoseconds)


def why_time_stands_still(node: Node) -> str:
    """Say that the node's clock waits for /clock, or ''."""
    clock: Any = node.get_clock()  # a ROSClock
    stands = clock.ros_time_is_active and clock.now().nanoseconds == 0
    return 'use_sim_time is true, and /clock has not come' if stands else ''
