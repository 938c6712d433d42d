"""What becomes of complete pairs: each enters once, and leaves once, answered or refused."""

# The worker is None where it is not active.
# pyright: reportOptionalMemberAccess=false

import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from idem_ros.core import IdemError
from idem_ros.node.control import Answer, answered
from idem_ros.node.traffic import Utilisation
from idem_ros.node.worker import LatestOnlyWorker
from idem_ros.pairing.pair import Pair, refined
from idem_ros.refinement.outcome import Refinement
from idem_ros.refinement.refiner import Refiner


@dataclass
class Job:
    """A pair on its way."""

    pair: Pair
    received: float | None
    """When its source came, of `time.monotonic` [s]; None: not known."""
    is_settled: bool = False
    """Whether it was answered or refused: refined once more, it counts no more."""


class Refining:
    """Refines the newest pair in a thread of its own, between `start` and `stop`.

    Args:
        pairing: has `without_target`, for the thread.
        utilisation: of the thread.
        on_result: called in the thread with (job, refinement); returns an `Answer`.
        on_refusal: called in the thread with (job, exception), for whatever the refinement or
            `on_result` raised; returns an `Answer`.

    Attributes:
        refiner: `Refiner`.
        is_paused: whether the newest pair is left unrefined.
    """

    def __init__(
        self,
        pairing: Any,
        utilisation: Utilisation,
        on_result: Callable[[Job, Refinement], Answer],
        on_refusal: Callable[[Job, Exception], Answer],
    ):
        self._pairing, self._utilisation = pairing, utilisation
        self._on_result, self._on_refusal = on_result, on_refusal
        self.refiner = Refiner()
        self.is_paused = False
        self._worker: LatestOnlyWorker | None = None
        self._newest: Job | None = None
        self._dropped_before = 0  # by workers of earlier

    @property
    def is_active(self) -> bool:
        """Whether it takes pairs."""
        return self._worker is not None

    @property
    def has_pair(self) -> bool:
        """Whether there is a newest pair, refined or not."""
        return self._newest is not None

    @property
    def is_busy(self) -> bool:
        """Whether a refinement is under way."""
        return self.is_active and self._worker.is_busy

    @property
    def waiting(self) -> int:
        """How many pairs wait: 0 or 1."""
        return self._worker.waiting if self.is_active else 0

    @property
    def dropped(self) -> int:
        """How many pairs were replaced by a newer one, or left behind by `stop`."""
        return self._dropped_before + (self._worker.dropped if self.is_active else 0)

    def start(self) -> None:
        """Take pairs from now on."""
        self._worker = LatestOnlyWorker(self._turn, is_paused=self.is_paused)

    def stop(self) -> None:
        """Let what is under way end, and drop what waits."""
        worker = self._worker
        worker.stop()
        self._worker, self._dropped_before = None, self._dropped_before + worker.dropped
        self.forget_newest()

    def submit(self, pair: Pair, received: float | None) -> None:
        """Take the newest pair, see `Job`; one that still waits is dropped."""
        self._newest = Job(pair, received)
        self._worker.submit(self._newest)

    def expect(self, target: Any) -> None:
        """Prepare a target before a source is paired with it, if there is nothing else to do."""
        if self._worker is not None:
            self._worker.when_idle(lambda: self._prepare(target))

    def pause(self, is_paused: bool) -> None:
        """Leave the newest pair unrefined from now on, or go on with it."""
        self.is_paused = is_paused
        if self.is_active:
            self._worker.pause(is_paused)

    def again(self) -> Future:
        """Have the newest pair refined now, be it once more; return a future `Answer`."""
        newest = self._newest
        # a newer one may have come until then, or a jump have had it forgotten
        return self.call_soon(
            lambda: self._turn(self._worker.take_waiting() or self._newest or newest)
        )

    def call_soon(self, task: Callable[[], Answer]) -> Future:
        """Call something in the thread before the next pair; return a future of its `Answer`."""
        if not self.is_active:
            return answered(Answer(False, 'the node is not active'))
        return self._worker.call_soon(task)

    def forget_newest(self) -> None:
        """Have no newest pair: a clock was set back."""
        self._newest = None

    def _prepare(self, target: Any) -> None:
        self._utilisation.begin(time.monotonic())
        try:
            self.refiner.expect(target)
        except IdemError:
            pass  # said of the source that it is paired with
        finally:
            self._utilisation.end(time.monotonic())

    def _turn(self, job: Any) -> Answer:
        self._utilisation.begin(time.monotonic())
        try:
            refinement = refined(self.refiner.refine, job.pair, self._pairing)
            return self._on_result(job, refinement)
        except Exception as error:  # a thread that died of one bad cloud would refine nothing
            return self._on_refusal(job, error)
        finally:
            job.is_settled = True
            self._utilisation.end(time.monotonic())
