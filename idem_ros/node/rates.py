"""How often, how late and how busy, over the last seconds; no ROS, and no clock of its own.

Times are seconds of a clock that is never set back, such as `time.monotonic()`. All may be used
from several threads.
"""

import threading
from collections import deque

SPAN = 5.0  # [s] that figures are of
MOST = 20_000  # times kept: 4 kHz over the span


class RecentValues:
    """Values with the times they came at, as far back as the span.

    Args:
        start: time from which it counts.
        span: [s].
    """

    def __init__(self, start: float, span: float = SPAN):
        self._start = start
        self._span = span
        self._kept: deque[tuple[float, float, int]] = deque(maxlen=MOST)
        self._lock = threading.Lock()

    def add(self, now: float, value: float = 0.0, count: int = 1) -> None:
        """Take note of a value at a time, for so many that came then."""
        with self._lock:
            self._kept.append((now, value, count))
            self._forget(now)

    def values(self, now: float) -> list[float]:
        """Return the values of the last span, oldest first."""
        return [value for _, value, _ in self._recent(now)]

    def rate(self, now: float) -> float:
        """Return how many came per second [Hz], over the span or since the start."""
        came = sum(count for _, _, count in self._recent(now))
        return came / max(min(self._span, now - self._start), 1.0)

    def _recent(self, now: float) -> list[tuple[float, float, int]]:
        with self._lock:
            self._forget(now)
            return list(self._kept)

    def _forget(self, now: float) -> None:
        while self._kept and self._kept[0][0] <= now - self._span:
            self._kept.popleft()


class Utilisation:
    """The share of the time that somebody was at work; see `RecentValues` for the arguments."""

    def __init__(self, start: float, span: float = SPAN):
        self._start = start
        self._span = span
        self._begun: float | None = None
        self._turns: deque[tuple[float, float]] = deque(maxlen=MOST)  # begin and end of each
        self._lock = threading.Lock()

    def begin(self, now: float) -> None:
        """Take note that work begins."""
        with self._lock:
            self._begun = now

    def end(self, now: float) -> None:
        """Take note that it ends; without a begin it counts nothing."""
        with self._lock:
            if self._begun is not None:
                self._turns.append((self._begun, now))
            self._begun = None

    def share(self, now: float) -> float:
        """Return the share of the last span, 0 to 1, that was work, with what is under way."""
        since = max(now - self._span, self._start)
        with self._lock:
            while self._turns and self._turns[0][1] <= since:
                self._turns.popleft()
            turns = [*self._turns, *([(self._begun, now)] if self._begun is not None else [])]
        busy = sum(end - max(begin, since) for begin, end in turns)
        return min(busy / (now - since), 1.0) if now > since else 0.0
