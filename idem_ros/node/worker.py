"""A worker thread that always takes the newest input and counts those it never took."""

import logging
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

_NOTHING = object()
NAME = 'idem_worker'  # of the threads
LOG = logging.getLogger(__name__)
LARGE = 500_000  # points: what takes longer to prepare than sources can wait


class LatestOnlyWorker:
    """Run one function in its own thread, on the newest input only.

    A one-slot mailbox: an input that is replaced before the thread took it is dropped and
    counted, so the result never lags more than one input behind. While it is paused the newest
    input stays in the mailbox. The thread starts at once and ends in `stop`, which joins it.

    Args:
        work: called in the thread with each input. The thread lives on, even if it raises: that
            is logged.
        is_paused: whether it begins so.
    """

    def __init__(
        self,
        work: Callable[[Any], Any],
        is_paused: bool = False,
    ):
        self._work = work
        self._changed = threading.Condition()
        self._newest: Any = _NOTHING
        self._tasks: deque[tuple[Future, Callable[[], Any]]] = deque()
        self._when_idle: Callable[[], Any] | None = None
        self._is_paused = is_paused
        self._stopping = False
        self._dropped = 0
        self._is_busy = False
        # daemon: an interpreter that a signal ends before `stop` could be called must not hang
        self._thread = threading.Thread(target=self._run, name=NAME, daemon=True)
        self._thread.start()

    @property
    def dropped(self) -> int:
        """How many inputs were replaced by a newer one, or left behind by `stop`."""
        with self._changed:
            return self._dropped

    @property
    def is_busy(self) -> bool:
        """Whether the work on an input, or a task, is under way."""
        with self._changed:
            return self._is_busy

    @property
    def waiting(self) -> int:
        """How many inputs are in the mailbox: 0 or 1."""
        with self._changed:
            return int(self._newest is not _NOTHING)

    def submit(self, item: Any) -> None:
        """Hand over the newest input without blocking; one that still waits is dropped."""
        with self._changed:
            if self._newest is not _NOTHING or self._stopping:
                self._dropped += 1
            if not self._stopping:
                self._newest = item
                self._changed.notify()

    def pause(self, is_paused: bool) -> None:
        """Leave the newest input in the mailbox from now on, or take it again."""
        with self._changed:
            self._is_paused = is_paused
            self._changed.notify()

    def take_waiting(self) -> Any:
        """Return the input in the mailbox and empty it; None where there is none. For tasks."""
        with self._changed:
            item, self._newest = self._newest, _NOTHING
            return None if item is _NOTHING else item

    def call_soon(self, task: Callable[[], Any]) -> Future:
        """Call something in the thread before the next input, paused or not, without blocking.

        Returns:
            A future of its value; cancelled where `stop` comes first.
        """
        future: Future = Future()
        with self._changed:
            if self._stopping:
                future.cancel()
            else:
                self._tasks.append((future, task))
                self._changed.notify()
        return future

    def when_idle(self, task: Callable[[], Any]) -> None:
        """Call something in the thread once nothing else is due, unless a newer one comes first.

        What it raises is logged.
        """
        with self._changed:
            self._when_idle = task
            self._changed.notify()

    def stop(self, patience: float | None = None) -> None:
        """Let the work under way end, drop what waits, and join the thread. May be repeated.

        Args:
            patience: how long to wait for the work under way [s]; None: until it ends. What is
                left then, `process.leave` ends with the process.
        """
        with self._changed:
            self._stopping = True
            if self._newest is not _NOTHING:
                self._newest = _NOTHING
                self._dropped += 1
            left = list(self._tasks)
            self._tasks.clear()
            self._changed.notify()
        for future, _ in left:
            future.cancel()
        self._thread.join(patience)

    def _run(self) -> None:
        while (step := self._next_step()) is not None:
            step()

    def _next_step(self) -> Callable[[], None] | None:
        with self._changed:
            self._is_busy = False
            self._changed.wait_for(
                lambda: self._stopping or self._tasks or self._is_due() or self._when_idle
            )
            self._is_busy = not self._stopping
            if self._stopping:
                return None
            if self._tasks:
                future, task = self._tasks.popleft()
                return lambda: _settle(future, task)
            if self._is_due():
                item, self._newest = self._newest, _NOTHING
                return lambda: self._do(lambda: self._work(item))
            idle, self._when_idle = self._when_idle, None
            assert idle is not None, 'what else it would have waited for'
            return lambda: self._do(idle)

    def _do(self, step: Callable[[], Any]) -> None:
        try:
            step()
        except Exception:  # nobody is left to tell; the next input may fare better
            LOG.exception('the work on an input failed')

    def _is_due(self) -> bool:
        return self._newest is not _NOTHING and not self._is_paused


def _settle(future: Future, task: Callable[[], Any]) -> None:
    if not future.set_running_or_notify_cancel():
        return
    try:
        future.set_result(task())
    except Exception as error:  # it is the caller's, who finds it in the future
        future.set_exception(error)


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
