"""What a process takes: memory, threads, open files, and its share of a core."""

import contextlib
import time
from dataclasses import dataclass

import psutil


@dataclass(frozen=True)
class Sample:
    """What a process took at one time."""

    time: float
    """[s] since the first sample."""
    cpu: float
    """[s] of a core, since the process began."""
    rss: int
    """[bytes] resident."""
    threads: int
    open_files: int


class Footprint:
    """Samples of a process, from now on; none any more once it has ended."""

    def __init__(self, pid: int):
        self._watched = psutil.Process(pid)
        self._start = time.monotonic()
        self.samples: list[Sample] = []
        self.sample()

    def sample(self) -> None:
        """Take a sample."""
        p = self._watched
        with contextlib.suppress(psutil.NoSuchProcess, psutil.AccessDenied):
            now = time.monotonic() - self._start
            cpu = sum(p.cpu_times()[:2])
            rss = p.memory_info().rss
            if rss:  # a process that has ended holds nothing
                self.samples.append(Sample(now, cpu, rss, p.num_threads(), p.num_fds()))

    def line(self) -> str:
        """Return the samples in words: CPU over all of them, the rest as it was last."""
        first, last = self.samples[0], self.samples[-1]
        share = (last.cpu - first.cpu) / max(last.time - first.time, 1e-9)
        return (
            f'{100 * share:.0f} % of a core, {last.rss / 1e6:.0f} MB, {last.threads} threads, '
            f'{last.open_files} open files'
        )
