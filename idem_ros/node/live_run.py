"""Refines a recording by a node in a process of its own, over real topics, scan by scan."""

import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped
from numpy.typing import NDArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from idem_ros.core import IdemError
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.node.player import Pace, Player, playing_node
from idem_ros.node.process import ended, node_command
from idem_ros.recording.reader import Recording
from idem_ros.recording.topics import Topics
from idem_ros.terminal.interrupts import held_back

QUEUE = 10
START_PATIENCE = 600.0  # [s] until the node listens: a slow machine compiles for minutes


class NodeFailed(IdemError):
    """The node's process did not start, died, or did not end as it should."""


@dataclass(frozen=True)
class Scan:
    """One source of a recording, and what the live node made of it."""

    stamp: int
    T_guess: NDArray | None
    """(4, 4); None where the recording has none for this source. So is `T_truth`."""
    T_truth: NDArray | None
    T_target_source: NDArray | None
    """(4, 4); None where no answer came."""
    diagnostics: dict[str, str]
    """Keys and values that came with the answer, or 'status' and 'reason' of a refusal."""


@dataclass
class _Poses:
    """The guesses or truths of a recording, by stamp; one of stamp 0 serves every source."""

    matrices: dict[int, NDArray] = field(default_factory=dict)

    def add(self, message) -> None:
        with suppress(IdemError):  # of a guess, the node says so too
            self.matrices[stamp_ns(message)] = matrix_of(message)

    def of(self, stamp: int) -> NDArray | None:
        return self.matrices.get(stamp, self.matrices.get(0))


class _Answers:
    """What the node publishes, by the stamp of the source."""

    def __init__(self, node: Node):
        self.transforms: dict[int, NDArray] = {}
        self.diagnostics: dict[int, dict[str, str]] = {}
        self.subscriptions = (
            node.create_subscription(
                TransformStamped, '/idem_node/transform', self._on_transform, QUEUE
            ),
            node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, QUEUE),
        )
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)

    def wait_for(self, stamp: int, patience: float) -> None:
        """Turn until transform and diagnostics came, or a refusal, or for `patience` [s]."""
        end = time.monotonic() + patience
        while not self._is_settled(stamp) and (left := end - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)

    def _is_settled(self, stamp: int) -> bool:
        values = self.diagnostics.get(stamp, {})
        return values.get('status') == 'refused' or bool(values and stamp in self.transforms)

    def _on_transform(self, message: TransformStamped) -> None:
        self.transforms[stamp_ns(message)] = matrix_of(message)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {each.key: each.value for each in status.values}
            if values.get('status', 'waiting') != 'waiting':
                self.diagnostics[stamp_ns(message)] = {**values, 'reason': status.message}


def refine_live(
    recording: Recording,
    topics: Topics,
    parameters: dict | None = None,
    *,
    rate: float = 1.0,
    patience: float = 2.0,
) -> Iterator[Scan]:
    """Start a node, play a recording to it, and yield each source with the node's answer.

    The next source is held back until the node has answered, or for `patience`, so that the node
    has time for each; so a source is answered only if its guess bears its stamp, or came before.
    The node listens reliably, to a latched target, and ends when the generator does.

    Args:
        recording: open.
        topics: which of its topics play which role.
        parameters: of the node, {name: value}.
        rate: of the recorded pace; the fastest it gets.
        patience: [s] until a source is taken for unanswered.

    Raises:
        NodeFailed: the node does not start, dies, or does not end with 0.
    """
    names = topics.names
    with playing_node('idem_live') as node, _started_node(topics, parameters or {}) as child:
        answers = _Answers(node)
        player = Player(node, recording, [name for name in names if name != topics.truth])
        _wait_until_connected(child, player, answers)
        guesses, truths = _Poses(), _Poses()
        poses = {topics.guess: guesses, topics.truth: truths}
        answered = partial(_answered, child, answers, patience, guesses, truths)
        played = _played(player, recording.messages(names), Pace(rate))
        yield from map(answered, _complete_sources(played, topics.source, poses))


def _complete_sources(played, source, poses):
    """Yield the stamp of each source when all is published that comes before the next one."""
    last = None
    for topic, message in played:
        if topic == source:
            if last is not None:
                yield last
            last = stamp_ns(message)
        elif topic in poses:
            poses[topic].add(message)
    if last is not None:
        yield last


def _played(player, messages, pace):
    """Yield each (topic, message), and publish it at its time afterwards."""
    for topic, log_time, message in messages:
        yield topic, message
        pace.wait(log_time)
        player.publish(topic, log_time, message)


def _answered(child, answers, patience, guesses, truths, stamp) -> Scan:
    answers.wait_for(stamp, patience)
    _require_alive(child)
    return Scan(
        stamp=stamp,
        T_guess=guesses.of(stamp),
        T_truth=truths.of(stamp),
        T_target_source=answers.transforms.get(stamp),
        diagnostics=answers.diagnostics.get(stamp, {}),
    )


@contextmanager
def _started_node(topics: Topics, parameters: dict) -> Iterator[subprocess.Popen]:
    inputs = {'target': topics.target, 'source': topics.source, 'initial_guess': topics.guess}
    values = {
        'reliability': 'reliable',
        'depth': QUEUE,
        'target_durability': 'transient_local',
        **parameters,
    }
    command = node_command(values, log_level='warn')
    for name, topic in inputs.items():
        if topic:
            command += ['-r', f'~/{name}:=/{topic.lstrip("/")}']
    child = None
    try:
        with held_back():  # Ctrl-C in between would leave the node behind
            child = subprocess.Popen(command)
        yield child
        if (code := ended(child)) != 0:
            raise NodeFailed(f'the node ended with exit code {code} on SIGTERM; it must be 0')
    finally:
        if child is not None:
            ended(child)


def _wait_until_connected(child, player: Player, answers: _Answers) -> None:
    end = time.monotonic() + START_PATIENCE
    while not (player.is_heard() and all(s.get_publisher_count() for s in answers.subscriptions)):
        _require_alive(child)
        if time.monotonic() > end:
            raise NodeFailed(f'the node does not listen {START_PATIENCE:.0f} s after its start')
        time.sleep(0.05)


def _require_alive(child) -> None:
    if child.poll() is not None:
        raise NodeFailed(f'the node has ended with exit code {child.returncode}')
