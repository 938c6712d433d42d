"""The order of stamps: what is late, what was set back, what may still come."""

from idem_ros.core.exceptions import IdemError

DISORDER = 500_000_000  # [ns] a stream's stamps that go back by more: its clock was set back


class NotYet(IdemError):
    """Something that a source still waits for, and that may come.

    Attributes:
        is_doubtful: nothing so far shows that it ever will; a source that is not the newest gives
            up.
    """

    def __init__(self, reason, is_doubtful=False):
        super().__init__(reason)
        self.is_doubtful = is_doubtful


class StampOrder:
    """Notices when a clock is set back, as by a recording in a loop, over several streams.

    A stamp that is a little older than the newest of its stream is only out of order. Stamp 0
    means that there is none.

    Attributes:
        jumps: how often a clock was set back; streams that follow each other count once.
        last_jump: by how much, the last time [ns].
    """

    def __init__(self):
        self.jumps = self.last_jump = 0
        self._newest = {}
        self._left = {}  # {stream: (where it was, where it went)}
        self._mixed = set()

    def goes_back(self, stream, stamp):
        """Note a stamp [ns] of a stream; return whether its clock was set back."""
        newest = self._newest.get(stream, stamp)
        if stamp and newest - stamp > DISORDER:
            self._set_back(stamp, newest)
            return True
        self._newest[stream] = max(newest, stamp)
        return False

    def stays_back(self, stream, stamp):
        """Note a stamp [ns] of a stream of many senders; return whether its clock was set back.

        A clock that was set back stays so: once the stamps leap forth again to where they had
        been, they are of several clocks, and tell nothing of any.
        """
        if stream in self._mixed:
            return False
        newest = self._newest.get(stream, stamp)
        if self.goes_back(stream, stamp):
            self._left[stream] = newest, stamp
            return True
        before, after = self._left.get(stream, (stamp, stamp))
        if 2 * (stamp - newest) > before - after > 0 and before - stamp < DISORDER:
            self._mixed.add(stream)
            del self._newest[stream]
        return False

    def clock_goes_back(self, now):
        """Note that the node's clock was set back to `now` [ns]; return whether that is news."""
        newest = max(self._newest.values(), default=now)
        if newest - now <= DISORDER:
            return False
        self._set_back(now, newest)
        return True

    def forget(self):
        """Forget the streams, but not how often a clock was set back."""
        self._newest.clear()
        self._left.clear()
        self._mixed.clear()

    def _set_back(self, stamp, newest):
        self.jumps += 1
        self.last_jump = newest - stamp
        self._newest = {name: min(kept, stamp) for name, kept in self._newest.items()}


def seconds(nanoseconds):
    """Return a time [ns] in words: '0.25 s'."""
    return f'{nanoseconds / 1e9:.3g} s'
