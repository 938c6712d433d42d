"""The registration that a node runs: what comes in, a worker that refines it, what goes out."""

# What it has from `open` to `close` is None outside.
# pyright: reportOptionalMemberAccess=false

import time
from concurrent.futures import Future
from dataclasses import replace
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from idem_ros.core import RegistrationConfig
from idem_ros.node.capsules import Capsules
from idem_ros.node.config import OutputConfig, SubscriptionConfig
from idem_ros.node.console import Console
from idem_ros.node.control import Answer, Control, answered
from idem_ros.node.diagnostics_publisher import PERIOD
from idem_ros.node.inputs import Inputs
from idem_ros.node.interface import EVERY_INPUT
from idem_ros.node.outputs import Publishing, require_outputs
from idem_ros.node.parameters import LiveParameters
from idem_ros.node.process import warm_up
from idem_ros.node.refining import Refining
from idem_ros.node.subscriptions import require_messages
from idem_ros.node.traffic import Traffic
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.map_target import MapConfig
from idem_ros.pairing.pair import Pair, Refusal
from idem_ros.pairing.targets import PairingConfig
from idem_ros.refinement.diagnostics import WARN
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.refinement.refiner import Refiner
from idem_ros.refinement.sweep_motion import BETWEEN_GUESSES


class LiveRegistration:
    """Refines the guess between target and source for a node; its topics are in `node.interface`.

    The callbacks only pair messages: clouds are converted and registered in a worker thread,
    which publishes what comes of it. A refused input becomes a diagnostic; the node lives on.

    It is open between `open` and `close`, where it listens to targets and guesses and offers its
    services, and active between `start` and `stop`, where it takes sources and publishes.

    Args:
        node: what it listens and publishes by; its parameters are declared.

    Raises:
        InvalidConfig: a parameter it was started with cannot be used.
    """

    def __init__(self, node: Node):
        self.node = node
        self._parameters = LiveParameters(node, self._configure, _require)
        self.traffic = Traffic(EVERY_INPUT, time.monotonic())
        self.inputs = Inputs(
            node,
            self.traffic,
            self._submit,
            self._refuse_input,
            self._on_jump,
            self._parameters.read()[MapConfig],
            lambda target: self.refining.refiner.prepare(target),
            lambda target: self.refining.expect(target),
        )
        self.refining = Refining(
            self.inputs,
            self.traffic.worker,
            on_result=lambda *given: self._publishing.result(*given),
            on_refusal=lambda *given: self._publishing.refusal(*given),
        )
        self._console = Console(node.get_logger())
        self._capsules = Capsules(node.get_logger())
        self._publishing: Publishing | None = None  # while it is open
        self._control: Control | None = None
        self._timer: Any = None
        self._configure(self._parameters.read())

    @property
    def is_active(self) -> bool:
        """Whether it takes sources."""
        return self.refining.is_active

    @property
    def dropped(self) -> int:
        """How many sources were never refined since the node was made."""
        return self.inputs.pairing.dropped + self.refining.dropped

    def open(self) -> None:
        """Make publishers and services, and listen to targets and guesses."""
        configs = self._parameters.read()
        self.inputs.read_map()
        self.refining.refiner = Refiner()
        self._configure(configs)
        kept = self.traffic, self._console, self._capsules
        self._publishing = Publishing(self.node, configs[OutputConfig], *kept, self._counts)
        # before there is a subscription: compiling holds the GIL for seconds
        warm_up(configs[RegistrationConfig].motion)
        self.inputs.open(configs[SubscriptionConfig])
        asked = {
            'refine_once': self.refine_once,
            'publish_region_of_interest': self.publish_region_of_interest,
            'reset': lambda: answered(self.reset()),
        }
        self._control = Control(self.node, self.pause, asked)

    def start(self) -> None:
        """Take sources, refine them, and publish."""
        self.refining.start()
        self._publishing.turn(is_on=True)
        wall = Clock(clock_type=ClockType.STEADY_TIME)  # simulated time may stand still
        self._timer = self.node.create_timer(PERIOD, self._report_period, clock=wall)
        self.inputs.listen()
        topics = ', '.join(self.inputs.subscriptions.topics)
        self.node.get_logger().info(f'ready: listens to {topics}')

    def stop(self) -> None:
        """Take no more sources, let the refinement under way be published, then nothing more.

        Sources that wait are dropped and counted. May be repeated.
        """
        if not self.is_active:
            return
        self.inputs.mute()
        self.node.destroy_timer(self._timer)
        self.refining.stop()
        self._capsules.stop()
        refused = self.traffic.refused + self.inputs.pairing.refused
        self._console.farewell(self.traffic.received, refused, self.dropped)
        self._publishing.turn(is_on=False)

    def close(self) -> None:
        """Stop, and let go of publishers, services and what was received. May be repeated."""
        self.stop()
        self.inputs.close()
        for each in (self._control, self._publishing):
            if each is not None:
                each.close()
        self._control = self._publishing = None

    def pause(self, is_paused: bool) -> Answer:
        """Leave the newest complete pair unrefined from now on, or go on with it."""
        self.refining.pause(is_paused)
        text = 'paused: the newest complete pair is kept' if is_paused else 'refines what comes'
        return Answer(True, text)

    def refine_once(self) -> Future:
        """Have the newest complete pair refined, be it once more; return a future `Answer`."""
        if self.is_active and not self.refining.has_pair:
            return answered(Answer(False, f'no pair yet: {self.inputs.what_it_waits_for()}'))
        return self.refining.again()

    def publish_region_of_interest(self) -> Future:
        """Have q_tot evaluated around the last result; return a future `Answer`."""
        return self.refining.call_soon(lambda: self._publishing.region())

    def reset(self) -> Answer:
        """Forget the last result as a guess, where guesses follow it."""
        kind = self.inputs.pairing.guess_type
        if not self.inputs.reset():
            return Answer(
                False, f'initial_guess.type is {kind}: no guess follows from the last result'
            )
        then = 'waits for a pose' if kind == 'initial_pose' else 'begins with the pose given last'
        self.node.get_logger().info(f'~/reset: the last result is forgotten; it {then}')
        return Answer(True, f'the last result is forgotten: it {then}')

    def _submit(self, pair: Pair, received: float | None) -> None:
        self.refining.submit(pair, received)

    def _refuse_input(self, refusal: Refusal) -> None:
        self._publishing.refused_input(refusal)

    def _on_jump(self, by: int) -> None:
        self.refining.forget_newest()
        self._publishing.clock_set_back(by)

    def _report_period(self) -> None:
        pairing, refining = self.inputs.pairing, self.refining
        if refining.is_busy:
            state = 'busy', 'a refinement is under way'
        elif refining.is_paused:
            state = 'paused', 'paused by ~/pause: the newest complete pair is kept'
        else:
            state = 'waiting', self.inputs.what_it_waits_for()
        counts = {
            'refused': self.traffic.refused + pairing.refused,
            'refused_targets': pairing.refused_targets,
            'heard_anew': self.inputs.hearing.anew,
            'waiting': pairing.waiting + refining.waiting,
        }
        names = sorted(self.inputs.subscriptions.held)
        load = self.traffic.load(time.monotonic(), self.dropped, counts, names)
        if unheard := self.inputs.unheard:
            reason = '; '.join([*unheard, load.reason])
            load = replace(load, level=max(load.level, WARN), reason=reason)
        self._publishing.period(*state, load)

    def _counts(self) -> dict[str, int]:
        return {'dropped': self.dropped, 'clock_jumps': self.inputs.pairing.jumps}

    def _configure(self, configs: dict[type, Any]) -> None:
        kinds = RegistrationConfig, PreprocessingConfig, PointTimeConfig
        self.refining.refiner.configure(*(configs[kind] for kind in kinds))
        waits = configs[RegistrationConfig].motion in BETWEEN_GUESSES
        self.inputs.pairing.sweeps.configure(configs[PointTimeConfig] if waits else None)
        self.inputs.configure(configs[PairingConfig], configs[GuessConfig])
        self._capsules.configure(configs)
        if self._publishing:
            self._publishing.configure(configs[OutputConfig])


def _require(configs: dict[type, Any]) -> None:
    """Refuse configurations that need messages which are not installed."""
    require_messages(configs[GuessConfig].type)
    require_outputs(configs[OutputConfig])
