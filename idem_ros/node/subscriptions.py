"""The node's inputs as subscriptions, with the quality of service that each needs."""

import time
from collections.abc import Callable, Iterable
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription

from idem_ros.node.config import AUTO, SubscriptionConfig
from idem_ros.node.interface import IMU_INPUTS, TF_INPUTS, Topic, inputs_with
from idem_ros.node.lazy_message import Unread, UnreadableMessage, begins_with_header, unread_of
from idem_ros.node.messages import class_needed
from idem_ros.node.publisher_qos import (
    TRANSIENT_LOCAL,
    VOLATILE,
    durabilities_for,
    in_words,
    offers_on,
    why_unheard,
)

TF_DEPTH = 100  # as tf2 has it
IMU_DEPTH = 200  # half a second at 400 Hz
GUESS_DEPTH = 1000  # a tenth of a second of 10 kHz: more than sources wait for
CLOUDS = 'target', 'source'
LATCHED = 'target', 'initial_guess', 'initial_pose'  # what may have been published once, before
# [s] that the executor rests for each message it took at once, and at most: under a flood the
# worker needs the interpreter, too
REST, LONGEST_REST = 1e-4, 5e-3


class Subscriptions:
    """What a node listens to; all calls are from the executor's thread.

    Args:
        node: listens.
        config: reliability, depth, and whether a map from before is asked for.
        callbacks: {input: takes its messages}.
        on_lost: takes an input and how many more of its messages DDS has lost.

    Attributes:
        held: {input: its subscriptions}; a map or a guess has two where its publishers differ.
    """

    def __init__(
        self,
        node: Node,
        config: SubscriptionConfig,
        callbacks: dict[str, Callable[[Any], None]],
        on_lost: Callable[[str, int], None],
    ):
        self._node, self._config = node, config
        self._callbacks, self._on_lost = callbacks, on_lost
        self._topics: dict[str, Topic] = {}
        self.held: dict[str, list[Subscription]] = {}

    @property
    def topics(self) -> list[str]:
        """The names of the topics."""
        return [each[0].topic_name for each in self.held.values()]

    def listen(self, names: Iterable[str], guess_type: str) -> None:
        """Subscribe to those inputs of a name that a type of guess asks for.

        Raises:
            InvalidConfig: the messages of the guess are not installed.
            RuntimeError: of rclpy's RCLError, such as for a topic of another type in this process;
                then it listens to none of them.
        """
        topics = {k: topic for k, topic in inputs_with(guess_type).items() if k in names}
        classes = {name: _class_of(topic.msgtype, guess_type) for name, topic in topics.items()}
        try:
            for name, topic in topics.items():
                self._topics[name] = topic
                self.held[name] = [
                    self._subscription(name, classes[name], each) for each in self._qualities(name)
                ]
        except RuntimeError:
            self.ignore(names)
            raise

    def ignore(self, names: Iterable[str]) -> None:
        """Listen to those inputs no longer."""
        for name in names:
            for each in self.held.pop(name, ()):
                self._node.destroy_subscription(each)

    def follow_offers(self) -> None:
        """Ask publishers of maps and guesses for what was published before, where they keep it."""
        for name in LATCHED:
            is_asked = name != 'target' or self._config.target_durability == AUTO
            if name in self.held and is_asked and (offers := self._offers_on(name)):
                self._ask_for(name, durabilities_for(offers))

    def _ask_for(self, name: str, durabilities: tuple[str, ...]) -> None:
        """Have subscriptions of these kinds; who has one already is sent nothing again."""
        before, kind = self.held[name], self.held[name][0].msg_type
        held = {each.qos_profile.durability: each for each in before}
        wanted = [self._quality(name, each) for each in durabilities]
        self.held[name] = [
            held.get(each.durability) or self._subscription(name, kind, each) for each in wanted
        ]
        for each in before:  # only now: no message falls between the two
            if each not in self.held[name]:
                self._node.destroy_subscription(each)

    def renew(self, name: str) -> str:
        """Subscribe to an input anew; return its topic."""
        before = self.held[name]
        kind, topic = before[0].msg_type, before[0].topic_name
        self.held[name] = [self._subscription(name, kind, each.qos_profile) for each in before]
        for each in before:  # only now: no message falls between the two
            self._node.destroy_subscription(each)
        return topic

    def could_hear(self, name: str) -> bool:
        """Whether an input has a publisher whose type and quality of service match."""
        qualities = [each.qos_profile for each in self.held[name]]
        kind = self._topics[name].msgtype
        return any(not why_unheard(kind, qualities, each) for each in self._offers_on(name))

    def in_words(self, names: Iterable[str]) -> str:
        """Say of some inputs which publishers their topics have."""
        return ', '.join(
            in_words(held[0].topic_name, self._offers_on(name))
            for name, held in self.held.items()
            if name in names
        )

    def unheard(self) -> list[str]:
        """Say which publishers the node does not hear, why, and what to do."""
        found = []
        for name, held in self.held.items():
            qualities = [each.qos_profile for each in held]
            for offer in self._offers_on(name):
                if why := why_unheard(self._topics[name].msgtype, qualities, offer):
                    found.append(f'{held[0].topic_name}: {why}')
        return found

    def _offers_on(self, name: str) -> list:
        return offers_on(self._node, self.held[name][0].topic_name)

    def _subscription(self, name: str, kind: Any, quality: QoSProfile) -> Subscription:
        events = SubscriptionEventCallbacks(
            message_lost=lambda info: self._on_lost(name, int(info.total_count_change)),
            incompatible_qos=lambda info: None,  # said by `unheard`, with the remedy
        )
        topic, callback = self._topics[name].name, self._callbacks[name]
        is_raw = name not in CLOUDS and begins_with_header(kind)
        read = unread_of(kind) if is_raw else None

        def on_message(message):
            """Take all that wait at once: waiting anew for each would be most of the work."""
            taken = [message] if name in CLOUDS else [message, *_waiting_in(subscription)]
            if messages := self._readable(name, read, taken) if read else taken:
                callback(*messages)
            time.sleep(min(REST * (len(taken) - 1), LONGEST_REST))

        subscription = self._node.create_subscription(
            kind, topic, on_message, quality, event_callbacks=events, raw=is_raw
        )
        return subscription

    def _readable(self, name: str, read: Callable[[bytes], Unread], taken: list[bytes]) -> list:
        """Return the messages that bytes are; those that are none are lost."""
        messages = []
        for content in taken:
            try:
                messages.append(read(content))
            except UnreadableMessage:
                self._on_lost(name, 1)
        return messages

    def _qualities(self, name: str) -> list[QoSProfile]:
        if name == 'target':
            asked = self._config.target_durability
            return [self._quality(name, VOLATILE if asked == AUTO else asked)]
        if name == 'tf_static':
            return [_latched(TF_DEPTH)]
        if name in TF_INPUTS:
            return [QoSProfile(depth=TF_DEPTH, reliability=ReliabilityPolicy.RELIABLE)]
        if name in IMU_INPUTS:
            return [QoSProfile(depth=IMU_DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT)]
        return [self._quality(name, VOLATILE)]

    def _quality(self, name: str, durability: str) -> QoSProfile:
        depth = self._config.depth if name in CLOUDS else GUESS_DEPTH
        if durability == TRANSIENT_LOCAL:
            return _latched(depth)
        return QoSProfile(
            depth=depth,
            reliability=ReliabilityPolicy[self._config.reliability.upper()],
            durability=DurabilityPolicy.VOLATILE,
        )


def require_messages(guess_type: str) -> None:
    """Refuse a type of guess whose messages are not installed.

    Raises:
        InvalidConfig: it says what to install.
    """
    for topic in inputs_with(guess_type).values():
        _class_of(topic.msgtype, guess_type)


def _waiting_in(subscription: Subscription) -> list[Any]:
    """Take the messages that wait in a subscription, as many as it holds at most."""
    messages = []
    with subscription.handle:
        while len(messages) < subscription.qos_profile.depth:
            taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
            if taken is None:
                break
            messages.append(taken[0])
    return messages


def _class_of(msgtype: str, guess_type: str) -> type:
    return class_needed(msgtype, f'initial_guess.type is {guess_type!r}')


def _latched(depth: int) -> QoSProfile:
    return QoSProfile(  # DDS sends what was published before reliably only
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )
