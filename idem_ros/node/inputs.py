"""What the node listens to: subscriptions, pairing, and what it waits for."""

# What it has from `open` to `close` is None outside.
# pyright: reportOptionalMemberAccess=false

import threading
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from idem_ros.maps.open_map import open_map
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.node.clock_watch import ClockWatch, why_time_stands_still
from idem_ros.node.config import SubscriptionConfig
from idem_ros.node.hearing import Hearing
from idem_ros.node.interface import INPUTS, POSE_INPUTS, TF_INPUTS
from idem_ros.node.publisher_qos import unheard_click
from idem_ros.node.subscriptions import Subscriptions, require_messages
from idem_ros.node.traffic import Traffic
from idem_ros.node.unforeseen import reason_of
from idem_ros.node.worker import NextTarget
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.map_target import REPLACE, MapConfig
from idem_ros.pairing.pair import Pair, Refusal
from idem_ros.pairing.pairing import Pairing
from idem_ros.pairing.targets import PairingConfig, UnusableTarget
from idem_ros.terminal.printable import error_line

RECEIPTS_KEPT = 64
PERIOD = 0.25  # [s] between looks at what publishers offer
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
        map_config: `MapConfig`; None: its defaults.
        prepare: prepares a target for those who refine, see `NextTarget`; None: it is not done.
        expect: called with each other target.

    Attributes:
        pairing: makes the pairs.
        are_one: whether target and source are one topic.
        subscriptions: while it is open.
        unheard: which publishers are not heard, why, and the remedy.
        hearing: counts how often it began to hear anew.
    """

    def __init__(
        self,
        node: Node,
        traffic: Traffic,
        on_pair: Callable[[Pair, float | None], None],
        on_refusal: Callable[[Refusal], None],
        on_jump: Callable[[int], None],
        map_config: MapConfig | None = None,
        prepare: Callable[[Any], None] | None = None,
        expect: Callable[[Any], None] = lambda target: None,
    ):
        self._node = node
        self._traffic = traffic
        self._on_pair, self._on_refusal, self._on_jump = on_pair, on_refusal, on_jump
        self._map_config = map_config or MapConfig()
        self.pairing = Pairing(map_config=self._map_config)
        is_topic = not self._map_config.target_file
        self.are_one = is_topic and self._topic_of('target') == self._topic_of('source')
        # what is not prepared ahead is when it is first refined
        add_next = partial(self._complete, self.pairing.add_target)
        self._next = NextTarget(prepare or (lambda _: None), add_next, self._refuse_next)
        self.subscriptions: Subscriptions | None = None
        self.unheard: list[str] = []
        self.hearing = Hearing(node.get_logger())
        self._lock = threading.RLock()  # around the pairing
        self._expect, self._receipts = expect, deque[tuple[int, float]](maxlen=RECEIPTS_KEPT)
        self._jumps_told = 0
        self._hindrance = ''
        self._clock_watch: Any = None
        self._timer: Any = None

    def read_map(self) -> None:
        """Take the map in `target_file` as the target, where one is named.

        Raises:
            UnusableMap, UnreadableCloud: it cannot be used.
        """
        if file := self._map_config.target_file:
            map_ = open_map(file, self._node.get_logger().info)
            with self._lock:
                self.pairing.add_map(map_)

    def open(self, config: SubscriptionConfig) -> None:
        """Begin to listen to targets and guesses.

        Raises:
            InvalidConfig: the messages of the guesses are not installed.
        """
        receivers = {
            'target': self.pairing.add_target,
            'source': self.pairing.add_scan if self.are_one else self.pairing.add_source,
            'tf_static': self.pairing.add_static_transforms,
            'imu': self.pairing.add_imu,
            **dict.fromkeys(('initial_guess', 'initial_pose', 'tf'), self.pairing.add_guess),
        }
        callbacks = {name: self._taking(name, add) for name, add in receivers.items()}
        role = 'source' if self.are_one else 'target'
        callbacks[role] = self._taking_target(callbacks[role])
        self.subscriptions = Subscriptions(self._node, config, callbacks, self._traffic.note_lost)
        self._clock_watch = ClockWatch(self._node, self._on_set_back)
        wall = Clock(clock_type=ClockType.STEADY_TIME)  # simulated time may stand still
        self._timer = self._node.create_timer(PERIOD, self._attend, clock=wall)
        has_target = not (self.are_one or self._map_config.target_file)
        names = (*(('target',) if has_target else ()), 'imu', *GUESSES)
        self.subscriptions.listen(names, self.pairing.guess_type)
        self.hearing.expect(names)

    def listen(self) -> None:
        """Begin to listen to sources."""
        self.subscriptions.listen(('source',), self.pairing.guess_type)
        self.hearing.expect(('source',))
        if self.are_one:
            self._node.get_logger().info(
                f'target and source are one topic, {self._topic_of("source")}: each scan is '
                'registered to the one before it'
            )

    def mute(self) -> None:
        """Listen to no more sources; those that wait are dropped and counted."""
        self.subscriptions.ignore(('source',))
        with self._lock:
            self.pairing.drop_sources()

    def close(self) -> None:
        """Listen to nothing any more, and forget what came. May be repeated."""
        if self.subscriptions is not None:
            self.subscriptions.ignore(tuple(self.subscriptions.held))
            self._node.destroy_timer(self._timer)
            self._clock_watch.close()
            self.subscriptions = None
        self._next.stop()
        self.hearing.close()
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
        if is_other and self.subscriptions is not None:
            self.subscriptions.ignore(GUESSES)
            self._subscribe_anew()

    def without_target(self, pair: Pair, error: UnusableTarget) -> Pair:
        """Pair a source with another target, see `Pairing.without_target`; for the worker."""
        with self._lock:
            return self.pairing.without_target(pair, error)

    def reset(self) -> bool:
        """Begin anew from the last pose that was given, see `Pairing.reset`."""
        with self._lock:
            return self.pairing.reset()

    def what_it_waits_for(self) -> str:
        """Say in words what the next pair lacks, and why."""
        with self._lock:
            missing, why = self.pairing.waiting_for(), self.pairing.why_it_waits()
        names = set(missing.split(' and '))
        if 'initial_guess' in names:
            names.update(GUESSES)
        if self.are_one and 'target' in names:
            names.add('source')
        guess_type = self.pairing.guess_type if 'initial_guess' in names else ''
        click = unheard_click(self._node, guess_type)
        reasons = [why, why_time_stands_still(self._node), self._hindrance, click, *self.unheard]
        waits = f'waiting for {missing} ({self.subscriptions.in_words(names)})'
        return '; '.join([waits, *filter(None, reasons)])

    def _attend(self) -> None:
        """Do what no message brings about."""
        self._tell_refusals()
        self._subscribe_anew()
        subscriptions = self.subscriptions
        assert subscriptions is not None, 'the timer is destroyed with them'
        subscriptions.follow_offers()
        self.hearing.attend(subscriptions, time.monotonic())
        unheard = subscriptions.unheard()
        for each in [each for each in unheard if each not in self.unheard]:
            self._node.get_logger().warning(f'not heard: {each}')
        self.unheard = unheard

    def _subscribe_anew(self) -> None:
        """Subscribe to guesses of another type, where that is not done yet.

        DDS refuses a topic with two types in one process; what hinders goes into
        `what_it_waits_for`, and this may be called again.
        """
        if any(name in self.subscriptions.held for name in GUESSES):
            return
        try:
            self.subscriptions.listen(GUESSES, self.pairing.guess_type)
            self.hearing.expect(GUESSES)
            self._hindrance = ''
        except RuntimeError as error:  # of rclpy's RCLError, which it does not export
            reason = error_line(error)
            self._hindrance = f'guesses cannot be subscribed to: {reason}'

    def _taking(self, name: str, add: Callable) -> Callable:
        def on_messages(*messages):
            self._note(name, messages[-1], len(messages))
            self._complete(add, *messages)
            self._tell_jumps()
            self._tell_refusals()

        return on_messages

    def _complete(self, add: Callable, *messages) -> None:
        with self._lock:
            pairs = add(*messages)
        for pair in pairs:
            self._on_pair(pair, self._receipt_of(pair.source))

    def _taking_target(self, take: Callable) -> Callable:
        """Return what takes targets and has them prepared: large ones before, if one serves."""

        def on_message(message):
            with self._lock:
                is_served = self.pairing.has_target() and self._map_config.target_mode == REPLACE
            if is_served and not self.are_one and self._next.takes(message):
                self._note('target', message)
            else:
                take(message)
                self._expect(message)

        return on_message

    def _refuse_next(self, message, error) -> None:
        reason = reason_of(error, self._node.get_logger())
        with self._lock:
            self.pairing.refuse_target(message, reason)

    def _tell_refusals(self) -> None:
        with self._lock:
            refusals = self.pairing.take_refusals()
        for refusal in refusals:
            self._on_refusal(refusal)

    def _topic_of(self, name: str) -> str:
        return self._node.resolve_topic_name(INPUTS[name].name)

    def _note(self, name: str, message, count: int = 1) -> None:
        """Take note of messages that came at once, of which sources come alone."""
        now = time.monotonic()
        self.hearing.note(name)
        lag = None
        if name == 'source':
            self._receipts.append((id(message), now))
            if stamp := stamp_ns(message):
                lag = (self._node.get_clock().now().nanoseconds - stamp) / 1e9
        self._traffic.note_input(name, now, lag, count)

    def _receipt_of(self, source) -> float | None:
        # an id is used again only for what came later, which is found first
        return next((at for each, at in reversed(self._receipts) if each == id(source)), None)

    def _on_set_back(self, now: int) -> None:
        with self._lock:
            self.pairing.clock_goes_back(now)
        self._tell_jumps()

    def _tell_jumps(self) -> None:
        if self.pairing.jumps != self._jumps_told:
            self._jumps_told = self.pairing.jumps
            self._on_jump(self.pairing.last_jump)
