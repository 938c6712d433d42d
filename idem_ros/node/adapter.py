"""The node: topics in, pairing, a worker thread that refines, topics out."""

import traceback

from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.node import Node

from idem_ros import diagnostics
from idem_ros.core import IdemError, RegistrationConfig, warm_up
from idem_ros.guesses import GuessConfig
from idem_ros.node.interface import CONFIGS, OUTPUTS, TF_INPUTS
from idem_ros.node.messages import (
    diagnostics_message,
    message_class,
    q_tot_message,
    transform_message,
)
from idem_ros.node.parameters import declare_parameters, read_config
from idem_ros.node.subscription_config import SubscriptionConfig
from idem_ros.node.subscriptions import subscribe
from idem_ros.node.worker import LatestOnlyWorker
from idem_ros.pairing import Pair, Pairing
from idem_ros.preprocessing import PreprocessingConfig
from idem_ros.refinement import Refinement, Refiner
from idem_ros.stamps import seconds
from idem_ros.targets import PairingConfig

NAME = 'idem_node'
RESULTS_KEPT = 10
REPORT_PERIOD = 1.0  # [s]
LEVELS = (DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR)


class RegistrationNode(Node):
    """Refines the guess between the newest target and source; see the README for its topics.

    The callbacks only pair messages: clouds are converted and registered in a worker thread,
    which publishes what comes of it. A refused input becomes a diagnostic; the node lives on.

    Args:
        node_options: as `rclpy.node.Node` takes them.

    Raises:
        InvalidConfig: a parameter it was started with cannot be used.
    """

    def __init__(self, **node_options):
        super().__init__(NAME, **node_options)
        declare_parameters(self)
        self._refiner = Refiner()
        self._pairing = Pairing(guess_config=read_config(self, GuessConfig))
        self._apply_parameters()
        subscription_config = read_config(self, SubscriptionConfig)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        self._jumps_reported = 0
        self._has_reported = self._reported_lately = False
        self._outputs = {
            name: self.create_publisher(message_class(topic.msgtype), topic.name, RESULTS_KEPT)
            for name, topic in OUTPUTS.items()
        }
        warm_up()  # before there is a subscription: compiling holds the GIL for seconds
        self._inputs = self._subscribe(subscription_config)
        backwards = JumpThreshold(
            min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=False
        )
        self._clock_watch = self.get_clock().create_jump_callback(
            backwards, post_callback=self._on_clock_jump
        )
        wall = Clock(clock_type=ClockType.STEADY_TIME)  # simulated time may stand still
        self.create_timer(REPORT_PERIOD, self._report_state, clock=wall)
        self._worker = LatestOnlyWorker(self._refine, self._publish, self._refuse)
        topics = ', '.join(subscription.topic_name for subscription in self._inputs.values())
        self.get_logger().info(f'ready: listens to {topics}')

    def destroy_node(self):
        """Let the refinement under way end, join the worker, and destroy the node."""
        self._worker.stop()
        self._clock_watch.unregister()
        super().destroy_node()

    def _subscribe(self, config: SubscriptionConfig) -> dict:
        receivers = {
            'target': self._pairing.add_target,
            'source': self._pairing.add_source,
            'initial_guess': self._pairing.add_guess,
            'tf': self._pairing.add_guess,
            'tf_static': self._pairing.add_static_transforms,
        }
        callbacks = {name: self._pairs_of(add) for name, add in receivers.items()}
        return subscribe(self, config, self._pairing.guess_type, callbacks)

    def _pairs_of(self, add):
        def on_message(message):
            for pair in add(message):
                self._worker.submit(pair)
            self._report_jumps()
            for refusal in self._pairing.take_refusals():
                self._report_refused(refusal.reason, refusal.stamp)

        return on_message

    def _on_clock_jump(self, jump: TimeJump) -> None:
        self._pairing.clock_goes_back(self.get_clock().now().nanoseconds)
        self._report_jumps()

    def _report_jumps(self) -> None:
        if self._pairing.jumps == self._jumps_reported:
            return
        self._jumps_reported = self._pairing.jumps
        text = (
            f'the clock was set back by {seconds(self._pairing.last_jump)}: what was buffered is '
            'forgotten'
        )
        self.get_logger().warning(text)
        now = self.get_clock().now().nanoseconds
        values = {'status': 'clock_set_back', **self._counts()}
        self._report(DiagnosticStatus.WARN, text, values, now)

    def _refine(self, pair: Pair) -> Refinement:
        return self._refiner.refine(pair)

    def _publish(self, pair: Pair, refinement: Refinement) -> None:
        if not self.context.ok():
            return
        self._outputs['transform'].publish(transform_message(refinement))
        self._outputs['q_tot'].publish(q_tot_message(refinement))
        values = diagnostics.refinement_values(refinement, self._dropped())
        level = LEVELS[diagnostics.level(refinement)]
        self._report(level, refinement.result.status.value, values, refinement.stamp)

    def _refuse(self, pair: Pair, error: Exception) -> None:
        if not self.context.ok():  # shutting down; publishing is what failed
            return
        if isinstance(error, IdemError):
            self._report_refused(str(error), pair.stamp)
            return
        self.get_logger().error(''.join(traceback.format_exception(error)))
        self._report_refused(f'unexpected {type(error).__name__}: {error}', pair.stamp)

    def _report_refused(self, reason: str, stamp: int) -> None:
        self.get_logger().warning(f'refused: {reason}', throttle_duration_sec=REPORT_PERIOD)
        values = {'status': 'refused', **self._counts()}
        self._report(DiagnosticStatus.ERROR, reason, values, stamp)

    def _report_state(self) -> None:
        """Say what the node is doing, where nothing was reported for a period."""
        if not self._reported_lately:
            is_busy = self._worker.is_busy
            level = DiagnosticStatus.WARN if self._has_reported else DiagnosticStatus.STALE
            status, level = ('busy', DiagnosticStatus.OK) if is_busy else ('waiting', level)
            text = 'a refinement is under way' if is_busy else self._what_it_waits_for()
            values = {'status': status, **self._counts()}
            now = self.get_clock().now().nanoseconds
            message = diagnostics_message(self._task(), level, text, values, now)
            self._outputs['diagnostics'].publish(message)
        self._reported_lately = False

    def _what_it_waits_for(self) -> str:
        missing = self._pairing.waiting_for()
        topics = [
            f'{each.topic_name} has {self.count_publishers(each.topic_name)} publishers'
            for name, each in self._inputs.items()
            if ('initial_guess' if name in TF_INPUTS else name) in missing.split(' and ')
        ]
        reasons = [self._pairing.why_it_waits(), self._why_time_stands_still()]
        return '; '.join([f'waiting for {missing} ({", ".join(topics)})', *filter(None, reasons)])

    def _why_time_stands_still(self) -> str:
        clock = self.get_clock()
        stands = clock.ros_time_is_active and clock.now().nanoseconds == 0
        return 'use_sim_time is true, and /clock has not come' if stands else ''

    def _report(self, level: bytes, text: str, values: dict, stamp: int) -> None:
        self._has_reported = self._reported_lately = True
        message = diagnostics_message(self._task(), level, text, values, stamp)
        self._outputs['diagnostics'].publish(message)

    def _task(self) -> str:
        return f'{self.get_name()}: registration'

    def _counts(self) -> dict[str, int]:
        return {'dropped': self._dropped(), 'clock_jumps': self._pairing.jumps}

    def _dropped(self) -> int:
        return self._pairing.dropped + self._worker.dropped

    def _check_parameters(self, changed) -> SetParametersResult:
        try:
            for config_type in CONFIGS:
                read_config(self, config_type, changed)
        except IdemError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply_parameters(self, changed=()) -> None:
        self._refiner.configure(
            read_config(self, RegistrationConfig), read_config(self, PreprocessingConfig)
        )
        self._pairing.configure(read_config(self, PairingConfig), read_config(self, GuessConfig))
