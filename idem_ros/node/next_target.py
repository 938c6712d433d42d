"""The next map, prepared while the one before it still serves."""

from collections.abc import Callable
from typing import Any

from idem_ros.node.worker import LatestOnlyWorker

LARGE = 500_000  # points: what takes longer to prepare than sources can wait


class NextTarget:
    """Prepares large targets in a thread of its own, the newest only.

    Args:
        prepare: takes a target, in the thread; raises where it cannot be used.
        on_ready: called in the thread with each that is prepared.
        on_refusal: called in the thread with each that cannot be used, and the error.
    """

    def __init__(
        self,
        prepare: Callable[[Any], None],
        on_ready: Callable[[Any], None],
        on_refusal: Callable[[Any, Exception], None],
    ):
        self._prepare, self._on_ready, self._on_refusal = prepare, on_ready, on_refusal
        self._worker: LatestOnlyWorker | None = None

    def takes(self, message: Any) -> bool:
        """Return whether a target is so large that it is prepared here; if so, begin."""
        if int(message.width) * int(message.height) <= LARGE:
            return False
        if self._worker is None:
            self._worker = LatestOnlyWorker(self._turn)
        self._worker.submit(message)
        return True

    def stop(self) -> None:
        """Let what is under way end; forget what waits. May be repeated."""
        if self._worker is not None:
            self._worker.stop()
            self._worker = None

    def _turn(self, message: Any) -> None:
        try:
            self._prepare(message)
        except Exception as error:  # a map that nobody foresaw is one that cannot be used
            self._on_refusal(message, error)
        else:
            self._on_ready(message)
