"""What comes in and goes out of the node: counts, rates, delays, and what they mean; no ROS.

Times are seconds of a clock that is never set back, such as `time.monotonic()`.
"""

import threading
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from idem_ros.refinement.diagnostics import OK, STALE, WARN

SPAN = 5.0  # [s] that figures are of
MOST = 20_000  # times kept: 4 kHz over the span
OTHER_CLOCK = 60.0  # [s] stamps farther from the node's clock are of another clock


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


@dataclass(frozen=True)
class Load:
    """A report on the traffic."""

    level: int
    """Of `idem_ros.refinement.diagnostics`."""
    reason: str
    values: dict[str, str]
    dropped: int = 0
    """Sources so far."""
    lost: int = 0
    """Messages so far."""
    share: float = 0.0
    """Of its time that the worker is busy."""


class Traffic:
    """Counts and times messages; `now` is [s] of a clock that is never set back.

    Every source that is `received` is in the end answered, refused or dropped, or it waits.

    Args:
        inputs: names of the inputs; sources are 'source'.
        now: when it begins.

    Attributes:
        received: sources that came.
        answered: sources whose result was published.
        refused: sources that were paired, and refused by the refinement.
        worker: `Utilisation` of the worker.
    """

    def __init__(self, inputs: Iterable[str], now: float):
        self.received = self.answered = self.refused = 0
        self.worker = Utilisation(now)
        self._inputs = {name: RecentValues(now) for name in inputs}
        self._lags = RecentValues(now)
        self._answers, self._answer_times = RecentValues(now), RecentValues(now)
        self._lost = dict.fromkeys(self._inputs, 0)
        self._dropped_before, self._lost_before = 0, 0

    def note_input(self, name: str, now: float, lag: float | None, count: int = 1) -> None:
        """Take note of messages that came at once.

        lag: [s] from stamp to receipt, None: no stamp.
        """
        self._inputs[name].add(now, count=count)
        if name == 'source':
            self.received += count
            if lag is not None:
                self._lags.add(now, lag)

    def note_lost(self, name: str, count: int) -> None:
        """Take note of messages that were sent, and lost on the way."""
        self._lost[name] += count

    def note_answer(self, now: float, since_receipt: float | None) -> None:
        """Take note of a result that was published, [s] after its source was received."""
        self.answered += 1
        self._answers.add(now)
        if since_receipt is not None:
            self._answer_times.add(now, since_receipt)

    def load(
        self, now: float, dropped: int, counts: dict[str, int], inputs: Iterable[str]
    ) -> Load:
        """Return what the last seconds were like.

        Args:
            now: [s].
            inputs: those to tell the rate of.
            dropped: sources dropped so far.
            counts: more numbers to report.
        """
        lags, times = self._lags.values(now), self._answer_times.values(now)
        share = self.worker.share(now)
        values = {
            **{f'{name}_hz': f'{self._inputs[name].rate(now):.2f}' for name in inputs},
            **{f'{name}_lost': str(self._lost[name]) for name in inputs},
            'result_hz': f'{self._answers.rate(now):.2f}',
            **_mean_and_worst('stamp_to_receipt', lags),
            **_mean_and_worst('receipt_to_publication', times),
            'utilisation': f'{share:.3f}',
            'received': str(self.received),
            'answered': str(self.answered),
            **{name: str(count) for name, count in counts.items()},
            'dropped': str(dropped),
        }
        level, reason = self._judged(now, dropped, share)
        reason = '; '.join([reason, *_other_clock(lags)])
        return Load(level, reason, values, dropped, sum(self._lost.values()), share)

    def _judged(self, now: float, dropped: int, share: float) -> tuple[int, str]:
        lost = sum(self._lost.values())
        newly_lost, self._lost_before = lost - self._lost_before, lost
        newly_dropped, self._dropped_before = dropped - self._dropped_before, dropped
        reasons = []
        if newly_dropped:
            reasons.append(
                f'{newly_dropped} sources were dropped since the last report: the worker is busy '
                f'{share:.0%} of the time'
            )
        if newly_lost:
            reasons.append(
                f'{newly_lost} messages were lost on the way since the last report: take '
                'reliability reliable, or config/fastdds_large_clouds.xml for every process'
            )
        if reasons:
            return WARN, '; '.join(reasons)
        if not self._inputs['source'].values(now):
            return STALE, f'no source has come in the last {SPAN:g} s'
        return OK, 'no source is dropped'


def _mean_and_worst(name: str, values: list[float]) -> dict[str, str]:
    mean = sum(values) / len(values) if values else float('nan')
    worst = max(values, default=float('nan'))
    return {f'{name}_s': f'{mean:.4f}', f'{name}_max_s': f'{worst:.4f}'}


def _other_clock(lags: list[float]) -> list[str]:
    if not lags or abs(lags[-1]) < OTHER_CLOCK:
        return []
    way = 'behind' if lags[-1] > 0 else 'ahead of'
    return [
        f'the stamps are {abs(lags[-1]):.3g} s {way} the clock of the node: where they are of a '
        'recording or a simulation, set use_sim_time and have /clock published'
    ]
