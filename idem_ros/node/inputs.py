"""What the node listens to: subscriptions, pairing, and what it waits for."""

import threading
import time
from collections import deque
from collections.abc import Callable

from rclpy.clock import JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.node import Node

from idem_ros.guesses import GuessConfig
from idem_ros.node.interface import INPUTS, POSE_INPUTS, TF_INPUTS
from idem_ros.node.subscription_config import SubscriptionConfig
from idem_ros.node.subscriptions import require_messages, subscribe
from idem_ros.node.traffic import Traffic
from idem_ros.pair import Pair, Refusal
from idem_ros.pairing import Pairing
from idem_ros.targets import PairingConfig, UnusableTarget
from idem_ros.transform_message import stamp_ns

RECEIPTS_KEPT = 64
GUESSES = ('initial_guess', *POSE_INPUTS, *TF_INPUTS)


class Inputs:
    """Subscribes for a node and pairs what comes.

    All calls are from the executor's thread, but for `without_target`, which is from the worker's.

    Targets and guesses are listened to from `open` on, sources between `listen` and `mute`. Where
    target and source are one topic, that is so from `listen` on: each scan is a target to the one
    after it.

    Args:
        node: listens.
        traffic: takes note of what comes.
        on_pair: called with each complete pair and when its source came (`time.monotonic`, [s]).
        on_refusal: called with each `Refusal`.
        on_jump: called with how far [ns] a clock was set back.
    """

    def __init__(
        self,
        node: Node,
        traffic: Traffic,
        on_pair: Callable[[Pair, float | None], None],
        on_refusal: Callable[[Refusal], None],
        on_jump: Callable[[int], None],
    ):
        self._node = node
        self._traffic = traffic
        self._on_pair, self._on_refusal, self._on_jump = on_pair, on_refusal, on_jump
        self.pairing = Pairing()
        self.are_one = self._topic_of('target') == self._topic_of('source')
        self.subscriptions = {}
        self._lock = threading.RLock()  # around the pairing
        self._quality = SubscriptionConfig()
        self._receipts: deque[tuple[int, float]] = deque(maxlen=RECEIPTS_KEPT)
        self._jumps_told = 0
        self._hindrance = ''
        self._clock_watch = None

    def open(self, config: SubscriptionConfig) -> None:
        """Begin to listen to targets and guesses.

        Raises:
            InvalidConfig: the messages of the guesses are not installed.
        """
        self._quality = config
        self._subscribe(GUESSES if self.are_one else ('target', *GUESSES))
        backwards = JumpThreshold(
            min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=False
        )
        self._clock_watch = self._node.get_clock().create_jump_callback(
            backwards, post_callback=self._on_clock_jump
        )

    def listen(self) -> None:
        """Begin to listen to sources."""
        self._subscribe(('source',))
        if self.are_one:
            self._node.get_logger().info(
                f'target and source are one topic, {self._topic_of("source")}: each scan is '
                'registered to the one before it'
            )

    def mute(self) -> None:
        """Listen to no more sources; those that wait are dropped and counted."""
        self._unsubscribe(('source',))
        with self._lock:
            self.pairing.drop_sources()

    def close(self) -> None:
        """Listen to nothing any more, and forget what came. May be repeated."""
        self._unsubscribe(tuple(self.subscriptions))
        if self._clock_watch is not None:
            self._clock_watch.unregister()
            self._clock_watch = None
        with self._lock:
            self.pairing.forget()

    def configure(self, config: PairingConfig, guess_config: GuessConfig) -> None:
        """Take other parameters for the pairs to come; for another type of guess, subscribe anew.

        Raises:
            InvalidConfig: its messages are not installed.
        """
        is_other = guess_config.type != self.pairing.guess_type
        if is_other:
            require_messages(guess_config.type)
        with self._lock:
            self.pairing.configure(config, guess_config)
        if is_other and self._clock_watch is not None:
            self._unsubscribe(GUESSES)
            self.subscribe_anew()

    def without_target(self, pair: Pair, error: UnusableTarget) -> Pair:
        """Pair a source with another target, see `Pairing.without_target`; for the worker."""
        with self._lock:
            return self.pairing.without_target(pair, error)

    def attend(self) -> None:
        """Do what no message brings about: to be called every second, see `subscribe_anew`."""
        self._tell_refusals()
        self.subscribe_anew()

    def reset(self) -> bool:
        """Begin anew from the last pose that was given, see `Pairing.reset`."""
        with self._lock:
            return self.pairing.reset()

    def subscribe_anew(self) -> None:
        """Subscribe to guesses of another type, where that is not done yet.

        DDS refuses a topic with two types in one process; what hinders goes into
        `what_it_waits_for`, and this may be called again.
        """
        if any(name in self.subscriptions for name in GUESSES):
            return
        try:
            self._subscribe(GUESSES)
            self._hindrance = ''
        except RuntimeError as error:  # of rclpy's RCLError, which it does not export
            reason = ' '.join(str(error).split())
            self._hindrance = f'guesses cannot be subscribed to: {reason}'

    def what_it_waits_for(self) -> str:
        """Say in words what the next pair lacks, and why."""
        with self._lock:
            missing, why = self.pairing.waiting_for(), self.pairing.why_it_waits()
        topics = [
            f'{each.topic_name} has {self._node.count_publishers(each.topic_name)} publishers'
            for name, each in self.subscriptions.items()
            if ('initial_guess' if name in GUESSES else name) in missing.split(' and ')
        ]
        reasons = [why, self._why_time_stands_still(), self._hindrance]
        return '; '.join([f'waiting for {missing} ({", ".join(topics)})', *filter(None, reasons)])

    def _why_time_stands_still(self) -> str:
        clock = self._node.get_clock()
        stands = clock.ros_time_is_active and clock.now().nanoseconds == 0
        return 'use_sim_time is true, and /clock has not come' if stands else ''

    def _subscribe(self, names: tuple[str, ...]) -> None:
        receivers = {
            'target': self.pairing.add_target,
            'source': self.pairing.add_scan if self.are_one else self.pairing.add_source,
            'initial_guess': self.pairing.add_guess,
            'initial_pose': self.pairing.add_guess,
            'tf': self.pairing.add_guess,
            'tf_static': self.pairing.add_static_transforms,
        }
        callbacks = {name: self._taking(name, receivers[name]) for name in names}
        guess_type = self.pairing.guess_type
        taken = subscribe(
            self._node, self._quality, guess_type, callbacks, self._traffic.note_lost
        )
        self.subscriptions.update(taken)

    def _unsubscribe(self, names: tuple[str, ...]) -> None:
        for name in names:
            if name in self.subscriptions:
                self._node.destroy_subscription(self.subscriptions.pop(name))

    def _taking(self, name: str, add: Callable) -> Callable:
        def on_message(message):
            self._note(name, message)
            with self._lock:
                pairs = add(message)
            for pair in pairs:
                self._on_pair(pair, self._receipt_of(pair.source))
            self._tell_jumps()
            self._tell_refusals()

        return on_message

    def _tell_refusals(self) -> None:
        with self._lock:
            refusals = self.pairing.take_refusals()
        for refusal in refusals:
            self._on_refusal(refusal)

    def _topic_of(self, name: str) -> str:
        return self._node.resolve_topic_name(INPUTS[name].name)

    def _note(self, name: str, message) -> None:
        now = time.monotonic()
        lag = None
        if name == 'source':
            self._receipts.append((id(message), now))
            if stamp := stamp_ns(message):
                lag = (self._node.get_clock().now().nanoseconds - stamp) / 1e9
        self._traffic.note_input(name, now, lag)

    def _receipt_of(self, source) -> float | None:
        # an id is used again only for what came later, which is found first
        return next((at for each, at in reversed(self._receipts) if each == id(source)), None)

    def _on_clock_jump(self, jump: TimeJump) -> None:
        with self._lock:
            self.pairing.clock_goes_back(self._node.get_clock().now().nanoseconds)
        self._tell_jumps()

    def _tell_jumps(self) -> None:
        if self.pairing.jumps != self._jumps_told:
            self._jumps_told = self.pairing.jumps
            self._on_jump(self.pairing.last_jump)
