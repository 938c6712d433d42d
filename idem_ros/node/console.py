"""What an operator reads on the console: each thing when it changes, and not too often; no ROS."""

import re
import threading
from typing import Protocol

from idem_ros.refinement.diagnostics import OK, is_registered, level, message_of
from idem_ros.refinement.outcome import Refinement
from idem_ros.terminal.printable import printable

EVERY = 5.0  # [s] drops, losses and bad verdicts are said so often at most
AGAIN = 60.0  # [s] what is waited for is said again, although it did not change
MEASURED = re.compile(r'\d+\.\d+')  # a number in a reason that differs each time
NUMBER = re.compile(r'(?<![^\s(\[])[-+]?\d+(\.\d+)?(e[-+]?\d+)?')  # not in a name
KINDS = 8  # of refusals that are said within EVERY: reasons may be as many as a stranger likes


class Logger(Protocol):
    """What a console writes to; that of a node."""

    def info(self, message: str) -> object:
        """Write a line."""

    def warning(self, message: str) -> object:
        """Write a line that an operator should act upon."""


class Console:
    """Says what changes; `now` is [s] of a clock that is never set back.

    Args:
        logger: takes the lines.
    """

    def __init__(self, logger: Logger):
        self._logger = logger
        self._results = self._bad = 0  # since the last warning
        self._warned: float | None = None
        self._waited_for, self._said = '', 0.0
        self._before = self._told = (0, 0)  # dropped and lost
        self._since: float | None = None  # when drops and losses were looked at first
        self._word = 'aligned'
        # {kind: when it was said, and how many came since}
        self._refusals: dict[str, tuple[float, int]] = {}
        self._lock = threading.Lock()  # around them: both threads refuse
        self.good = self.answered = 0

    def result(self, refinement: Refinement, now: float) -> None:
        """Count an answer; warn of one that is not aligned, with how many of the last were not."""
        self._waited_for = ''
        self._word = 'aligned' if refinement.result.assessment else 'converged'
        self.answered += 1
        self.good += is_registered(refinement.result)
        self._results += 1
        if level(refinement) == OK:
            return
        self._bad += 1
        if self._warned is None or now - self._warned >= EVERY:
            of_last = f' ({self._bad} of the last {self._results} results)'
            said = printable(message_of(refinement))
            self._logger.warning(said + (of_last if self._bad > 1 else ''))
            self._results, self._bad, self._warned = 0, 0, now

    def refused(self, reason: str, now: float) -> None:
        """Say why an input was refused: each kind at once, then every few seconds with its number.

        Kinds differ in more than numbers; of very many, some are left to the counts.
        """
        kind = kind_of(reason)
        with self._lock:
            kept = {k: each for k, each in self._refusals.items() if now - each[0] < AGAIN}
            at, since = kept.pop(kind, (-AGAIN, 0))
            is_due = now - at >= EVERY
            if is_due and sum(now - each < EVERY for each, _ in kept.values()) >= KINDS:
                return
            self._refusals = {**kept, kind: (now, 0) if is_due else (at, since + 1)}
        if is_due:
            often = f' ({since + 1} times in the last {now - at:.0f} s)' if since else ''
            self._logger.warning(printable(f'refused: {reason}{often}'))

    def waiting(self, text: str, now: float) -> None:
        """Say what is waited for, where that has changed, or was said long ago."""
        waited_for = MEASURED.sub('', text)
        if waited_for != self._waited_for or now - self._said >= AGAIN:
            self._waited_for, self._said = waited_for, now
            self._logger.warning(printable(text))

    def load(self, dropped: int, lost: int, share: float, now: float) -> None:
        """Say how many sources were dropped, and messages lost, in the last seconds.

        Args:
            dropped: sources so far.
            lost: messages so far.
            share: of its time that the worker is busy.
        """
        totals = dropped, lost
        if self._since is None or totals == self._before == self._told:
            self._since = now  # nothing for a while: what comes next is of the time from now on
        self._before = totals
        seconds = now - self._since
        if totals == self._told or seconds < EVERY:
            return
        newly = [total - told for total, told in zip(totals, self._told, strict=True)]
        self._told, self._since = totals, now
        if newly[0]:
            self._logger.warning(
                f'{newly[0]} sources were dropped in the last {seconds:.0f} s: the worker is busy '
                f'{share:.0%} of the time; a larger voxel_size takes less'
            )
        if newly[1]:
            self._logger.warning(
                f'{newly[1]} messages were lost on the way in the last {seconds:.0f} s: take '
                'reliability reliable, or config/fastdds_large_clouds.xml for every process'
            )

    def farewell(self, received: int, refused: int, dropped: int) -> None:
        """Say what became of all sources."""
        good = f': {self.good} {self._word}, {self.answered - self.good} not'
        self._logger.info(
            f'of {received} sources {self.answered} answered{good if self.answered else ""}; '
            f'{refused} refused, {dropped} dropped'
        )


def kind_of(text: str) -> str:
    """Return a text without its numbers: what is the same on and on differs in these."""
    return NUMBER.sub('', text)
