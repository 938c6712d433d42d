"""Points in the columns of a square grid: those of a box are found without a look at the rest."""

import numpy as np

from idem_ros.core.jit import compiler

LEAST_EDGE = 16.0  # [m]
MOST_CELLS = 250  # along x and y: the number of a column has 16 bits
SAMPLE = 10_000
SHARE = 0.005  # of the points at each end may be strays: they lie in the outermost columns

kernel = compiler(nogil=True)


class SortedPoints:
    """Points by column; the outermost columns reach to infinity, so that strays cost nothing.

    Args:
        points: (N, 3) finite, N >= 1.

    Attributes:
        bounds: (2, 3) lowest and highest coordinates.
    """

    def __init__(self, points):
        sample = points[:: max(len(points) // SAMPLE, 1), :2]
        self._low, high = np.quantile(sample, (SHARE, 1.0 - SHARE), axis=0)
        extent = high - self._low
        self._edge = max(float(extent.max()) / MOST_CELLS, LEAST_EDGE)
        self._most = (extent / self._edge).astype(np.int64)  # the last column along x and y
        self._start, self._points, self.bounds = _sorted(
            np.ascontiguousarray(points), self._low, self._edge, self._most
        )

    def __len__(self):
        return len(self._points)

    @property
    def nbytes(self):
        """What is kept [bytes]."""
        return self._points.nbytes + self._start.nbytes

    def within(self, low, high):
        """Return the (M, 3) points with low <= p < high, in an order of their own."""
        (x, y), (x_last, y_last) = self._columns_of(low), self._columns_of(high)
        rows = np.arange(y, y_last + 1) * (self._most[0] + 1)
        runs = [self._points[self._start[row + x] : self._start[row + x_last + 1]] for row in rows]
        inside = [run[((run >= low) & (run < high)).all(axis=1)] for run in runs]
        return np.concatenate(inside) if inside else np.empty((0, 3))

    def densest(self):
        """Return the points of the column that holds most."""
        fullest = int(np.argmax(np.diff(self._start)))
        return self._points[self._start[fullest] : self._start[fullest + 1]]

    def _columns_of(self, corner):
        return tuple(
            _column(corner[axis], self._low[axis], self._edge, self._most[axis]) for axis in (0, 1)
        )


@kernel
def _sorted(points, low, edge, most):
    """Return where each column begins, the points by column, as they came, and their bounds."""
    columns = (most[0] + 1) * (most[1] + 1)
    column = np.empty(len(points), np.uint16)
    start = np.zeros(columns + 2, np.int64)
    bounds = np.empty((2, 3))
    bounds[0], bounds[1] = points[0], points[0]
    for i in range(len(points)):
        for axis in range(3):
            v = points[i, axis]
            bounds[0, axis], bounds[1, axis] = min(v, bounds[0, axis]), max(v, bounds[1, axis])
        x = _column(points[i, 0], low[0], edge, most[0])
        y = _column(points[i, 1], low[1], edge, most[1])
        c = y * (most[0] + 1) + x
        column[i] = c
        start[c + 2] += 1
    for c in range(2, columns + 2):
        start[c] += start[c - 1]
    ordered = np.empty((len(points), 3))
    for i in range(len(points)):
        at = start[column[i] + 1]  # after the loop this is where the next column begins
        start[column[i] + 1] += 1
        for axis in range(3):
            ordered[at, axis] = points[i, axis]
    return start[:-1], ordered, bounds


@kernel
def _column(value, low, edge, most):
    return np.int64(min(max(np.floor((value - low) / edge), 0.0), np.float64(most)))
