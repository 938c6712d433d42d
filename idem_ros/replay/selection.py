"""Which sources of a recording are refined: those of a span of time, and of them every n-th."""

import math


class Selection:
    """Says of one source after the other whether it is to be refined.

    Args:
        settings: `Settings`.
        begin: of the recording [ns].

    Attributes:
        left_out: sources that are not.
    """

    def __init__(self, settings, begin):
        self._settings = settings
        self._first = begin + round(settings.start * 1e9)
        seconds = settings.duration
        self._end = math.inf if seconds is None else self._first + round(seconds * 1e9)
        self._inside = 0
        self.left_out = 0

    def takes(self, log_time):
        """Return whether the next source is to be refined; log_time [ns]."""
        taken = False
        if self._first <= log_time < self._end:
            taken = self._inside % self._settings.every == 0
            self._inside += 1
        self.left_out += not taken
        return taken

    def is_over(self, log_time):
        """Return whether no source from log_time [ns] on is to be refined."""
        return log_time >= self._end

    def notes(self):
        """Return what was left out, in a sentence; none where nothing was."""
        if not self.left_out:
            return []
        start, duration, every = (
            self._settings.start,
            self._settings.duration,
            self._settings.every,
        )
        until = '' if duration is None else f' for {duration:g} s'
        taken = f'one in {every} is taken, from {start:g} s on{until}'
        return [f'{self.left_out} sources left out: {taken}']
