"""A worker thread that always takes the newest input and counts those it never took."""

import threading
from collections.abc import Callable
from typing import Any

_NOTHING = object()


class LatestOnlyWorker:
    """Run one function in its own thread, on the newest input only.

    A one-slot mailbox: an input that is replaced before the thread took it is dropped and
    counted, so the result never lags more than one input behind. The thread starts at once and
    ends in `stop`, which joins it.

    Args:
        work: called in the thread with each input; its value goes to `on_result`.
        on_result: called in the thread with (input, value).
        on_error: called in the thread with (input, exception) for whatever `work` or `on_result`
            raised; the thread lives on.
    """

    def __init__(
        self,
        work: Callable[[Any], Any],
        on_result: Callable[[Any, Any], None],
        on_error: Callable[[Any, Exception], None],
    ):
        self._work = work
        self._on_result = on_result
        self._on_error = on_error
        self._changed = threading.Condition()
        self._newest: Any = _NOTHING
        self._stopping = False
        self._dropped = 0
        self._is_busy = False
        # daemon: an interpreter that a signal ends before `stop` could be called must not hang
        self._thread = threading.Thread(target=self._run, name='idem_worker', daemon=True)
        self._thread.start()

    @property
    def dropped(self) -> int:
        """How many inputs were replaced by a newer one, or left behind by `stop`."""
        with self._changed:
            return self._dropped

    @property
    def is_busy(self) -> bool:
        """Whether the work on an input is under way."""
        with self._changed:
            return self._is_busy

    def submit(self, item: Any) -> None:
        """Hand over the newest input without blocking; one that still waits is dropped."""
        with self._changed:
            if self._newest is not _NOTHING or self._stopping:
                self._dropped += 1
            if not self._stopping:
                self._newest = item
                self._changed.notify()

    def stop(self) -> None:
        """Let the work under way end, drop what waits, and join the thread. May be repeated."""
        with self._changed:
            self._stopping = True
            if self._newest is not _NOTHING:
                self._newest = _NOTHING
                self._dropped += 1
            self._changed.notify()
        self._thread.join()

    def _run(self) -> None:
        while (item := self._take()) is not _NOTHING:
            try:
                self._on_result(item, self._work(item))
            except Exception as error:  # a thread that died of one bad cloud would refine nothing
                self._on_error(item, error)

    def _take(self) -> Any:
        with self._changed:
            self._is_busy = False
            self._changed.wait_for(lambda: self._stopping or self._newest is not _NOTHING)
            item, self._newest = self._newest, _NOTHING
            self._is_busy = item is not _NOTHING
            return item
