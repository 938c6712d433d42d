"""When the guesses reach over the sweep of a source, so that its motion lies between two."""

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.stamps import NotYet, seconds
from idem_ros.messages.transform_message import stamp_ns


class SweepEnds:
    """Has the newest source wait for a guess at the end of its sweep, where that is wanted.

    The one before it has waited long enough.
    """

    def __init__(self):
        self._point_times = None
        self._known = None, 0  # the source asked for last, and the end of its sweep [ns]

    def configure(self, point_times):
        """Wait for the ends of sweeps by a `PointTimeConfig`; None: for none."""
        self._point_times = point_times

    def require(self, source, guess):
        """Have a source wait whose guesses end before its sweep does.

        Raises:
            NotYet: they do.
        """
        if self._point_times is None or guess.trail is None or not guess.trail.stamps:
            return
        missing = self._end_of(source) - guess.trail.stamps[-1]
        if missing > 0:
            raise NotYet(f'the newest is {seconds(missing)} older than the end of the sweep')

    def _end_of(self, source):
        if self._known[0] is not source:
            self._known = source, stamp_ns(source) + round(1e9 * _end(source, self._point_times))
        return self._known[1]


def _end(source, point_times):
    """Return the time of the last point [s after the stamp]; 0 where there is none."""
    try:
        times = read_points(source, point_times).times.times
    except IdemError:  # said when it is refined
        return 0.0
    return 0.0 if times is None else float(times.max())
