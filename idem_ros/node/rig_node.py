"""The node that watches a rig, and warns where a sensor is no longer where it was calibrated."""

import time
from functools import partial
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2

from idem_ros.calibration.config import RigWatchConfig, require_rig
from idem_ros.calibration.initial_extrinsics import read_starts
from idem_ros.calibration.rig_watch import RigWatch, Watched
from idem_ros.calibration.sighting_messages import (
    SILENT,
    LiveRig,
    Row,
    preparing,
    sighting_of,
)
from idem_ros.core import RegistrationConfig
from idem_ros.messages.building import CLOUD
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.node.console import kind_of
from idem_ros.node.interface import RIG_CONFIGS, RIG_DECIDED, RIG_OUTPUT
from idem_ros.node.messages import diagnostics_message
from idem_ros.node.parameters import LiveParameters
from idem_ros.node.ports import domain_of, no_dead_ports
from idem_ros.node.process import warm_up
from idem_ros.node.publisher_qos import in_words, offers_on, why_unheard
from idem_ros.node.unforeseen import reason_of
from idem_ros.node.worker import LatestOnlyWorker
from idem_ros.refinement.diagnostics import ERROR, OK, STALE, WARN
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.terminal.printable import printable

NAME = 'idem_rig_node'
REPORT_S = 1.0  # from one status to the next
STALE_PERIODS = 3  # without an instant
KEPT = 10
PATIENCE_S = 2.0  # with an instant under way, at the end: launch sends SIGKILL after ten


class Status(NamedTuple):
    """One status of the diagnostics."""

    level: int
    text: str
    values: dict[str, str]
    about: tuple[str, ...] = ()
    """The sensors that are not as they should be: when these change, an operator is told."""


def watched(found: list[Watched], flaws: list[str]) -> Status:
    """Return the status of an instant.

    Args:
        found: of each sensor but the reference.
        flaws: what was left out, a line each.
    """
    moved = [each for each in found if each.drift is not None and each.drift.has_moved]
    unknown = [each for each in found if each.drift is None]
    said = [f'{each.name} has moved by {each.drift}' for each in moved]
    said += [f'{each.name} cannot be told: {each.verdict.reason}' for each in unknown]
    about = tuple(each.name for each in (*moved, *unknown))
    values = {name: value for each in found for name, value in _values(each).items()}
    if not (about or flaws):
        return Status(OK, f'{len(found) + 1} sensors are where they were calibrated', values)
    return Status(WARN, '; '.join([*said, *flaws]), values, (*about, *flaws))


def failed(reason: str) -> Status:
    """Return the status of an instant of which nothing can be said."""
    return Status(ERROR, reason, {}, (reason,))


def waiting(text: str) -> Status:
    """Return the status while nothing comes."""
    return Status(STALE, text, {}, (text,))


def _values(each: Watched) -> dict[str, str]:
    values = {f'{each.name}: verdict': each.verdict.verdict.value}
    if each.drift is not None:
        values[f'{each.name}: moved_m'] = f'{each.drift.metres:.6g}'
        values[f'{each.name}: moved_deg'] = f'{each.drift.degrees:.6g}'
        values[f'{each.name}: sigmas'] = f'{each.drift.sigmas:.4g}'
    return values


class RigNode(Node):
    """Holds a rig against its extrinsics from its start to its end.

    The callbacks only gather messages; clouds are read and registered in a worker thread, one
    instant each period. The status "extrinsics" on /diagnostics says what came of the last.

    Args:
        node_options: as `rclpy.node.Node` takes them.

    Raises:
        IdemError: a parameter it was started with, or the extrinsics, cannot be used.
    """

    def __init__(self, **node_options):
        with no_dead_ports(domain_of(node_options.get('context'))):
            super().__init__(NAME, **node_options)
        self._worker: Any = None  # before it has begun
        self._status, self._looked, self._submitted = waiting(''), None, None
        self._is_over = False
        self._told: tuple | None = None  # what the console said last
        try:
            self._start()
        except Exception:
            self.destroy_node()  # at once: who waits for the garbage leaves its ports behind
            raise

    def destroy_node(self):
        """Let the work under way end, unless that takes long, and destroy the node."""
        self._is_over = True  # what is found now has nowhere to go
        if self._worker is not None:
            self._worker.stop(PATIENCE_S)
        super().destroy_node()

    def _start(self) -> None:
        parameters = LiveParameters(
            self,
            self._configure,
            lambda configs: require_rig(configs[RigWatchConfig]),
            RIG_CONFIGS,
            RIG_DECIDED,
        )
        self._configs = parameters.read()
        rig = self._configs[RigWatchConfig]
        self._watch = RigWatch(read_starts(rig.extrinsics, rig.topics), rig.instants)
        self._live = LiveRig(len(rig.topics))
        self._publisher = self.create_publisher(DiagnosticArray, RIG_OUTPUT.name, KEPT)
        # before there is a subscription: compiling holds the GIL for seconds
        warm_up(self._configs[RegistrationConfig].motion)
        self._worker = LatestOnlyWorker(self._look)
        quality = QoSProfile(depth=5, reliability=ReliabilityPolicy[rig.reliability.upper()])
        self._heard = [
            self.create_subscription(PointCloud2, topic, partial(self._take, number), quality)
            for number, topic in enumerate(rig.topics)
        ]
        wall = Clock(clock_type=ClockType.STEADY_TIME)  # simulated time may stand still
        self.create_timer(REPORT_S, self._report, clock=wall)
        topics = ', '.join(each.topic_name for each in self._heard)
        self.get_logger().info(f'ready: listens to {topics}')

    def _configure(self, configs: dict[type, Any]) -> None:
        self._configs = configs
        if self._worker is not None:
            self._worker.call_soon(self._watch.forget)  # which is of the worker's thread

    def _take(self, number: int, message: PointCloud2) -> None:
        self._live.add(number, message)
        now, period = time.monotonic(), self._configs[RigWatchConfig].period
        is_due = self._submitted is None or now - self._submitted >= period
        if is_due and number == 0 and (row := self._live.row()) is not None:
            self._submitted = now
            self._worker.submit((row, self._flaws()))

    def _look(self, job: tuple[Row, list[str]]) -> None:
        """Hold an instant against the extrinsics, in the worker's thread."""
        configs, (row, flaws) = self._configs, job
        prepare = preparing(configs[PreprocessingConfig])
        try:
            sighting, unusable = sighting_of(row, configs[PointTimeConfig], prepare)
            found = self._watch.take(sighting, row.names, configs[RegistrationConfig])
            status = watched(found, unusable + flaws)
        except Exception as error:  # else the last status would be said on and on
            status = failed(reason_of(error, self.get_logger()))
        self._status, self._looked = status, time.monotonic()
        self._publish(status, stamp_ns(row.messages[0]))

    def _report(self) -> None:
        """Say every second what the last instant came to, or what is waited for."""
        status, period = self._status, self._configs[RigWatchConfig].period
        since = None if self._looked is None else time.monotonic() - self._looked
        patience = STALE_PERIODS * period + STALE_PERIODS * REPORT_S
        if not self._worker.is_busy and (since is None or since > patience):
            status = waiting(self._what_it_waits_for())
        elif since is None:
            status = waiting('the first instant is under way')
        self._publish(status, self.get_clock().now().nanoseconds)

    def _publish(self, status: Status, stamp: int) -> None:
        if self._is_over:
            return
        level, text, values, about = status
        said = self.get_fully_qualified_name(), 'extrinsics', level, text, values, stamp
        self._publisher.publish(diagnostics_message(*said))
        told = level, tuple(map(kind_of, about))
        if self._told != told:
            self._told = told
            self._say(level, printable(text))

    def _say(self, level: int, text: str) -> None:
        if level == OK:  # not in one line: rclpy refuses one that changes its severity
            self.get_logger().info(text)
        else:
            self.get_logger().warning(text)

    def _flaws(self) -> list[str]:
        """Say what keeps sensors out of instants, a line each."""
        said = []
        for number, why in self._live.flaws().items():
            each = self._heard[number]
            offers = offers_on(self, each.topic_name) if why == SILENT else []
            reasons = [why_unheard(CLOUD, [each.qos_profile], offer) for offer in offers]
            said.append(': '.join([f'{each.topic_name} {why}', *filter(None, reasons)]))
        return said

    def _what_it_waits_for(self) -> str:
        topics = [each.topic_name for each in self._heard]
        said = [in_words(topic, offers_on(self, topic)) for topic in topics]
        return 'waiting for clouds: ' + '; '.join([*said, *self._flaws()])
