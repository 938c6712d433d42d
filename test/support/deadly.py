"""Tasks of `idem evaluate`, and one among them that kills its worker."""

import os
import signal
from dataclasses import dataclass
from pathlib import Path
from threading import Event

from idem_ros.evaluation.one_recording import Outcome, Task
from idem_ros.replay.settings import Settings

NO_TOPICS = {}


@dataclass(frozen=True)
class Deadly:
    """A task that ends its worker as SIGKILL does, in the midst, as often as it is told to."""

    path: str
    marks: str
    times: int
    settings: Settings = Settings()
    done: frozenset = frozenset()

    @property
    def topics(self):
        marks = Path(self.marks)
        before = len(list(marks.iterdir()))
        if before < self.times:
            (marks / str(before)).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return NO_TOPICS


@dataclass(frozen=True)
class Beside:
    """A task that goes on once another has ended its worker, and notes each time it begins."""

    path: str
    begun: str
    marks: str
    settings: Settings = Settings()
    done: frozenset = frozenset()

    @property
    def topics(self):
        (Path(self.begun) / str(os.getpid())).touch()
        tick = Event()
        for _ in range(600):
            if any(Path(self.marks).iterdir()):
                break
            tick.wait(0.1)
        return NO_TOPICS


def tasks_of(bags):
    return [Task(bag, Settings(), NO_TOPICS) for bag in bags]


def looked_at(task, progress=None):
    """What stands for an evaluation where only the processes matter."""
    return Outcome(task.path, text=f'of {len(task.topics)} topics')
