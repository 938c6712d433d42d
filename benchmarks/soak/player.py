"""The other side of a soak, a process of its own: publishes clouds, times what comes back.

Run as `python -m benchmarks.soak.player --rate 10 --seconds 60 --points 120000`; says
when it begins, and prints a `Played` as JSON once the node has settled every source.
"""

import argparse
import itertools
import json
import signal
import sys
import time
from dataclasses import asdict, dataclass, field

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import PointCloud2

from benchmarks.soak.stream import Tick, moving_stream, street_stream
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.node.player import playing_node

CLASSES = {'target': PointCloud2, 'source': PointCloud2, 'initial_guess': TransformStamped}
TICKS = 4  # scans that differ; after them it starts over
QUEUE = 10
RESULTS_KEPT = 1000
START_PATIENCE = 120.0  # [s]
SETTLING_PATIENCE = 15.0  # [s]
REPORT_PERIOD = 1.1  # [s] the node reports once a second
PLAYS = 'plays'
END = signal.SIGUSR1  # ends the play before its time
LOAD = 'load'  # the status that counts


@dataclass
class Played:
    """What was published and what came back; times are [ns] of the monotonic clock."""

    published: dict[int, int] = field(default_factory=dict)
    """{stamp of a source: when its publication began}"""
    answered: dict[int, int] = field(default_factory=dict)
    """{stamp: when its transform came}, in the order they came"""
    load: dict[str, str] = field(default_factory=dict)
    """What the node said last of its traffic."""
    undone: int = 0
    """Answers that tell the motion of their sweep."""
    late_ms: float = 0.0
    """How far the player itself fell behind its rate, at most."""

    @property
    def unsettled(self) -> int:
        """Sources that the node says it received, but neither answered, refused nor dropped."""
        settled = sum(int(self.load[name]) for name in ('answered', 'refused', 'dropped'))
        return int(self.load['received']) - settled


class SoakPlayer:
    """Publishes ticks to the node and collects what it answers."""

    def __init__(self, node: Node):
        self.played = Played()
        self.is_told_to_end = False
        self._publishers = {
            name: node.create_publisher(kind, f'/idem_node/{name}', QoSProfile(depth=QUEUE))
            for name, kind in CLASSES.items()
        }
        self._results = node.create_subscription(
            TransformStamped, '/idem_node/transform', self._on_transform, RESULTS_KEPT
        )
        node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, QUEUE)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)

    def wait_for_node(self) -> bool:
        """Turn until the node listens and is listened to; return whether it did in time."""
        return self._turn_until(self._is_connected, START_PATIENCE)

    def play(self, ticks: list[Tick], rate: float, seconds: float) -> None:
        """Publish ticks at a rate [1/s], over and over, and turn in between, until told to end."""
        start = time.monotonic()
        for number, tick in enumerate(itertools.cycle(ticks)):
            due = start + number / rate
            if due >= start + seconds or self.is_told_to_end:
                return
            self._turn_until(lambda: False, due - time.monotonic())
            self.played.late_ms = max(self.played.late_ms, 1e3 * (time.monotonic() - due))
            self._publish(tick)

    def settle(self) -> None:
        """Turn until the node says that it has settled all that it received, or for a while."""
        self.played.load = {}  # what it said while it was still receiving
        self._turn_until(lambda: False, REPORT_PERIOD)
        self._turn_until(self._is_settled, SETTLING_PATIENCE)

    def _publish(self, tick: Tick) -> None:
        stamp = time.time_ns()
        for name, cdr in tick.stamped(stamp).items():
            if name == 'source':
                self.played.published[stamp] = time.monotonic_ns()
            self._publishers[name].publish(cdr)

    def _turn_until(self, condition, patience: float) -> bool:
        end = time.monotonic() + patience
        while not (met := condition()) and (left := end - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=min(left, 0.1))
        return met

    def _is_connected(self) -> bool:
        heard = all(each.get_subscription_count() for each in self._publishers.values())
        return heard and self._results.get_publisher_count() > 0

    def _is_settled(self) -> bool:
        return bool(self.played.load) and self.played.unsettled == 0

    def _on_transform(self, message: TransformStamped) -> None:
        self.played.answered.setdefault(stamp_ns(message), time.monotonic_ns())

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {each.key: each.value for each in status.values}
            if status.name.endswith(LOAD):
                self.played.load = values
            self.played.undone += 'twist' in values


def main() -> int:
    """Play, print what came of it; return 1 where no node came."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--rate', type=float, required=True, help='[1/s]')
    parser.add_argument('--seconds', type=float, required=True)
    parser.add_argument('--points', type=int, required=True, help='of each cloud')
    parser.add_argument('--moving', action='store_true', help='sweeps, their points with times')
    args = parser.parse_args()
    ticks = (moving_stream if args.moving else street_stream)(args.points, TICKS)
    with playing_node('idem_soak') as node:
        player = SoakPlayer(node)
        signal.signal(END, lambda signum, frame: setattr(player, 'is_told_to_end', True))
        if not player.wait_for_node():
            print(f'no node listens after {START_PATIENCE} s', file=sys.stderr)
            return 1
        print(PLAYS, flush=True)
        player.play(ticks, args.rate, args.seconds)
        player.settle()
        print(json.dumps(asdict(player.played)))
    return 0


if __name__ == '__main__':
    sys.exit(main())
