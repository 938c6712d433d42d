"""`idem_node --find`: the clouds, poses and frames on the graph, and a command line for them."""

import time
from dataclasses import dataclass, field
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from idem_ros.messages.building import CLOUD
from idem_ros.node.messages import message_class
from idem_ros.node.publisher_qos import offers_on
from idem_ros.pairing.guesses import STREAMED, TF
from idem_ros.terminal.markdown import table
from idem_ros.terminal.printable import printable

LISTENED = 3.0  # [s]
POSES = {msgtype: kind for kind, msgtype in STREAMED.items()}
KINDS = (CLOUD, *POSES, TF)


@dataclass
class Heard:
    """A topic, and what came on it."""

    topic: str
    msgtype: str
    is_latched: bool
    messages: int = 0
    frames: tuple[str, str] = ('', '')
    """Of the last message: header frame and child frame."""
    points: int = 0
    edges: set[tuple[str, str]] = field(default_factory=set)
    """Of tf: (parent, child)."""

    def take(self, message: Any) -> None:
        """Note a message."""
        self.messages += 1
        if self.msgtype == TF:
            self.edges |= {(t.header.frame_id, t.child_frame_id) for t in message.transforms}
            return
        self.frames = message.header.frame_id, getattr(message, 'child_frame_id', '')
        self.points = getattr(message, 'width', 0) * getattr(message, 'height', 0)


def find(node: Node, seconds: float = LISTENED) -> list[Heard]:
    """Listen to every cloud, pose and tf on the graph for some seconds; return what was heard."""
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    heard: dict[str, Heard] = {}
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for topic, msgtypes in node.get_topic_names_and_types():
            for msgtype in {*msgtypes} & {*KINDS}:
                if topic not in heard and (offers := offers_on(node, topic)):
                    latched = any(each.is_latched for each in offers)
                    heard[topic] = Heard(topic, msgtype, latched)
                    _listen(node, heard[topic])
        executor.spin_once(timeout_sec=0.05)
    executor.remove_node(node)
    return sorted(heard.values(), key=lambda each: (KINDS.index(each.msgtype), each.topic))


def _listen(node: Node, heard: Heard) -> None:
    try:
        kind = message_class(heard.msgtype)
    except ImportError:  # tf2_msgs is not installed: the topic is named all the same
        return
    latched = DurabilityPolicy.TRANSIENT_LOCAL, ReliabilityPolicy.RELIABLE
    usual = DurabilityPolicy.VOLATILE, ReliabilityPolicy.BEST_EFFORT
    durability, reliability = latched if heard.is_latched else usual
    quality = QoSProfile(depth=5, durability=durability, reliability=reliability)
    node.create_subscription(kind, heard.topic, heard.take, quality)


def told(heard: list[Heard], seconds: float) -> str:
    """Return a table of what was heard, and a command line that fits it."""
    rows = [
        (
            each.topic,
            each.msgtype.rpartition('/')[2],
            'latched' if each.is_latched else f'{each.messages / seconds:.1f} Hz',
            ' > '.join(filter(None, each.frames)) or ', '.join(' > '.join(e) for e in each.edges),
            each.points or '',
        )
        for each in heard
    ]
    shown = table(['topic', 'type', 'rate', 'frames', 'points'], rows, left=4)
    return f'{shown}\n{printable(proposal(heard)) or "no cloud is published: nothing to refine"}'


def proposal(heard: list[Heard]) -> str:
    """Return the command line of a node for what was heard; empty where there is no cloud."""
    clouds = [each for each in heard if each.msgtype == CLOUD and each.messages]
    streams = [each for each in clouds if not each.is_latched] or clouds
    if not streams:
        return ''
    source = max(streams, key=lambda each: (each.messages, each.points))
    maps = [each for each in clouds if each.is_latched and each is not source]
    target = max(maps, key=lambda each: each.points, default=source)
    words = [f"-r '~/target:={target.topic}'", f"-r '~/source:={source.topic}'"]
    words += _guess_words(heard, target.frames[0], source.frames[0])
    return f'idem_node --ros-args {" ".join(words)}'


def _guess_words(heard: list[Heard], target_frame: str, source_frame: str) -> list[str]:
    edges = {edge for each in heard for edge in each.edges}
    if target_frame != source_frame and _connected(edges, target_frame, source_frame):
        return ['-p initial_guess.type:=tf']
    poses = [each for each in heard if each.msgtype in POSES and each.messages]
    poses.sort(key=lambda each: _likeness(each.topic))
    fitting = [each for each in poses if each.frames == (target_frame, source_frame)]
    for each in fitting or [each for each in poses if each.frames[0] == target_frame]:
        kind = f'-p initial_guess.type:={POSES[each.msgtype]}'
        return [f"-r '~/initial_guess:={each.topic}'", kind]
    return ['-p initial_guess.type:=last']


def _likeness(topic: str) -> int:
    """A guess says so as a rule, and so does a truth, which is none."""
    name = topic.lower()
    return 2 if 'truth' in name or 'gt' in name.split('/') else 0 if 'guess' in name else 1


def _connected(edges: set[tuple[str, str]], one: str, other: str) -> bool:
    reached, before = {one}, set()
    while reached != before:
        before = set(reached)
        reached |= {child for parent, child in edges if parent in before}
        reached |= {parent for parent, child in edges if child in before}
    return other in reached
