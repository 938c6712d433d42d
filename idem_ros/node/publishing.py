"""What leaves the node of its pairs: of each its result, or why it was refused, once."""

import time
from collections.abc import Callable

from rclpy.node import Node

from idem_ros.messages.stamps import seconds
from idem_ros.node.capsules import Capsules
from idem_ros.node.config import OutputConfig
from idem_ros.node.console import Console
from idem_ros.node.control import Answer, what_came_of
from idem_ros.node.diagnostics_publisher import Report
from idem_ros.node.outputs import Outputs
from idem_ros.node.refining import Job
from idem_ros.node.traffic import Load, Traffic
from idem_ros.node.unforeseen import AGAIN, reason_of
from idem_ros.pairing.pair import Refusal
from idem_ros.refinement.debug_clouds import slice_of
from idem_ros.refinement.outcome import Refinement


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
