"""The node's inputs as subscriptions, with the quality of service that each needs."""

from collections.abc import Callable
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription

from idem_ros.node.interface import TF_INPUTS, inputs_with
from idem_ros.node.messages import class_needed
from idem_ros.node.subscription_config import SubscriptionConfig

TF_DEPTH = 100  # as tf2 has it


def subscribe(
    node: Node,
    config: SubscriptionConfig,
    guess_type: str,
    callbacks: dict[str, Callable[[Any], None]],
    on_lost: Callable[[str, int], None],
) -> dict[str, Subscription]:
    """Subscribe to those inputs with a callback that a type of guess asks for.

    Args:
        node: listens.
        config: reliability and depth.
        guess_type: of `GuessConfig`.
        callbacks: {input: takes its messages}.
        on_lost: takes an input and how many more of its messages DDS has lost.

    Returns:
        {input: subscription}

    Raises:
        InvalidConfig: the messages of the guess are not installed.
    """
    topics = {k: topic for k, topic in inputs_with(guess_type).items() if k in callbacks}
    classes = {name: _class_of(topic.msgtype, guess_type) for name, topic in topics.items()}
    return {
        name: node.create_subscription(
            classes[name],
            topic.name,
            callbacks[name],
            _quality(name, config),
            event_callbacks=_losses_of(name, on_lost),
        )
        for name, topic in topics.items()
    }


def require_messages(guess_type: str) -> None:
    """Refuse a type of guess whose messages are not installed.

    Raises:
        InvalidConfig: it says what to install.
    """
    for topic in inputs_with(guess_type).values():
        _class_of(topic.msgtype, guess_type)


def _class_of(msgtype: str, guess_type: str) -> type:
    return class_needed(msgtype, f'initial_guess.type is {guess_type!r}')


def _losses_of(name: str, on_lost: Callable[[str, int], None]) -> SubscriptionEventCallbacks:
    return SubscriptionEventCallbacks(
        message_lost=lambda info: on_lost(name, int(info.total_count_change))
    )


def _quality(name: str, config: SubscriptionConfig) -> QoSProfile:
    latched = QoSProfile(  # DDS sends what was published before reliably only
        depth=TF_DEPTH if name in TF_INPUTS else config.depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )
    if name == 'tf_static' or (name == 'target' and config.target_durability == 'transient_local'):
        return latched
    if name in TF_INPUTS:
        return QoSProfile(depth=TF_DEPTH, reliability=ReliabilityPolicy.RELIABLE)
    return QoSProfile(
        depth=config.depth, reliability=ReliabilityPolicy[config.reliability.upper()]
    )
