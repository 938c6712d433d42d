"""What the publishers of a topic offer, and why a subscription does not hear them."""

from typing import NamedTuple

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from idem_ros.node.interface import POSE_INPUTS
from idem_ros.pairing.guesses import FOLLOWING, POSE, STREAMED, TF
from idem_ros.terminal.printable import counted

VOLATILE, TRANSIENT_LOCAL = 'volatile', 'transient_local'


class Offer(NamedTuple):
    """What one publisher offers."""

    by: str
    """Fully qualified name of its node."""
    msgtype: str
    quality: QoSProfile

    @property
    def is_latched(self) -> bool:
        """Whether DDS sends what was published before to one who asks for it."""
        return (
            self.quality.durability == DurabilityPolicy.TRANSIENT_LOCAL
            and self.quality.reliability == ReliabilityPolicy.RELIABLE
        )

    def __str__(self):
        reliability, durability = self.quality.reliability.name, self.quality.durability.name
        kind = self.msgtype.rpartition('/')[2]
        keeps = self.quality.durability == DurabilityPolicy.TRANSIENT_LOCAL and not self.is_latched
        lost = ', of which nothing from before is sent: that takes reliable' if keeps else ''
        return f'{kind}, {reliability.lower()}, {durability.lower()}{lost}'


def offers_on(node: Node, topic: str) -> list[Offer]:
    """Return what the publishers offer that a node knows of on a topic."""
    return [
        Offer(
            f'{each.node_namespace.rstrip("/")}/{each.node_name}',
            each.topic_type,
            each.qos_profile,
        )
        for each in node.get_publishers_info_by_topic(topic)
    ]


def in_words(topic: str, offers: list[Offer]) -> str:
    """Say how many publishers a topic has, and what they offer."""
    kinds = '; '.join(sorted({str(each) for each in offers}))
    return f'{topic} has {counted(len(offers), "publisher")}' + (f' ({kinds})' if kinds else '')


def durabilities_for(offers: list[Offer]) -> tuple[str, ...]:
    """Return what to ask for, so that every publisher is heard, with all that it kept.

    Whoever asks for what was published before is deaf to publishers that keep nothing.
    """
    latched = [each.is_latched for each in offers]
    volatile = (VOLATILE,) if not all(latched) or not offers else ()
    return volatile + ((TRANSIENT_LOCAL,) if any(latched) else ())


def why_unheard(msgtype: str, qualities: list[QoSProfile], offer: Offer) -> str:
    """Say why subscriptions to a topic do not hear a publisher, and the remedy.

    Args:
        msgtype: that they listen for.
        qualities: of the subscriptions.
        offer: of the publisher.

    Returns:
        Empty where one of them hears it.
    """
    if offer.msgtype != msgtype:
        return f'{offer.by} publishes {offer.msgtype}, the node listens for {msgtype}' + _type_of(
            offer.msgtype
        )
    lacks = [_lacking(each, offer) for each in qualities]
    return f'{offer.by} {lacks[0]}' if lacks and all(lacks) else ''


def _lacking(asked: QoSProfile, offer: Offer) -> str:
    offered, remedy = offer.quality, 'set target_durability to auto'
    if offer.msgtype == TF:
        remedy = 'have it published as tf2 does'
    if _is(asked.durability, offered.durability, DurabilityPolicy.TRANSIENT_LOCAL):
        return f'offers volatile, the node asks for transient_local: {remedy}'
    if _is(asked.reliability, offered.reliability, ReliabilityPolicy.RELIABLE):
        if offer.msgtype != TF and asked.durability != DurabilityPolicy.TRANSIENT_LOCAL:
            remedy = 'set reliability to best_effort'
        return f'offers best_effort, the node asks for reliable: {remedy}'
    return ''


def _is(asked, offered, more) -> bool:
    known = offered.name not in ('UNKNOWN', 'SYSTEM_DEFAULT')
    return known and asked == more and offered != more


def _type_of(msgtype: str) -> str:
    kinds = [kind for kind, each in STREAMED.items() if each == msgtype]
    if not kinds:
        return ': remap the topic, or have it converted'
    one = ', or for a single pose to initial_pose' if msgtype == POSE else ''
    return f': set initial_guess.type to {kinds[0]}{one}'


def unheard_click(node: Node, guess_type: str) -> str:
    """Say that a pose is published by hand which a type of guess does not listen to, or ''.

    guess_type: '' of no guess that is waited for.
    """
    if guess_type in ('', *FOLLOWING):
        return ''
    topic = node.resolve_topic_name(POSE_INPUTS['initial_pose'].name)
    is_published = node.count_publishers(topic) > 0
    unheard = f'{topic} is published, which initial_guess.type initial_pose would listen to'
    return unheard if is_published else ''
