"""What is said of the times of points: once for a stream, and when it changes."""

import re

from idem_ros.messages.point_times import NO_FIELD

NUMBER = re.compile(r'\d+(\.\d+)?(e[+-]\d+)?')
NOTES_KEPT = 5


class TimesSaid:
    """Remembers what was said of the clouds of each role.

    Attributes:
        notes: the first few that differ in more than numbers.
    """

    def __init__(self):
        self._last = {}
        self._has_times = False
        self._told = set()
        self.notes = []

    def news(self, **clouds):
        """Say how the times of clouds were read, or why there are none; empty where that is known.

        A stream that never had times is no news.

        Args:
            **clouds: {role: `TimesRead`}.
        """
        told = []
        for role, (times, said) in clouds.items():
            before = self._last.get(role, NO_FIELD)
            self._last[role] = said or before
            self._has_times |= role == 'source' and times is not None
            if said and said != before:
                told.append(f'{role}: {said}' + ('; taken as none' if times is None else ''))
        for each in told:
            self._keep(each)
        return '; '.join(told)

    def notes_for(self, motion):
        """Yield the notes, and that nothing is undone where `motion` is "none" and times came."""
        yield from self.notes
        if motion == 'none' and self._has_times:
            yield 'motion is none: what the sensor moves during a sweep is not undone (--motion)'

    def _keep(self, note):
        words = NUMBER.sub('', note)
        if words not in self._told and len(self.notes) < NOTES_KEPT:
            self._told.add(words)
            self.notes.append(f'sweeps: {note}')
