"""When the guesses reach over the sweep of a source, so that its motion lies between two."""

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.stamps import NotYet, seconds
from idem_ros.messages.transform_message import stamp_ns

PATIENCE = 2  # sources


class SweepEnds:
    """Has the newest sources wait for a guess at the end of their sweeps, where that is wanted.

    A source waits until the second after it comes: a guess may come with the next.
    """

    def __init__(self):
        self._point_times = None
        self._ends = {}  # {id of a source that waits: the end of its sweep [ns]}

    def configure(self, point_times):
        """Wait for the ends of sweeps by a `PointTimeConfig`; None: for none."""
        self._point_times = point_times

    def require(self, source, guess, waiting):
        """Have one of the newest sources wait whose guesses end before its sweep does.

        Raises:
            NotYet: they do.
        """
        if self._point_times is None or guess.trail is None or not guess.trail.stamps:
            return
        if not any(source is each for each in list(waiting)[-PATIENCE:]):
            return
        kept = {id(each) for each in waiting}
        self._ends = {key: end for key, end in self._ends.items() if key in kept}
        missing = self._end_of(source) - guess.trail.stamps[-1]
        if missing > 0:
            raise NotYet(f'the newest is {seconds(missing)} older than the end of the sweep')

    def _end_of(self, source):
        if id(source) not in self._ends:
            end = round(1e9 * _end(source, self._point_times))
            self._ends[id(source)] = stamp_ns(source) + end
        return self._ends[id(source)]


def _end(source, point_times):
    """Return the time of the last point [s after the stamp]; 0 where there is none."""
    try:
        times = read_points(source, point_times).times.times
    except IdemError:  # said when it is refined
        return 0.0
    return 0.0 if times is None else float(times.max())
