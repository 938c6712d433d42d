"""Where things stand in a scene: a smooth line through corners, and free places beside it."""

import numpy as np
from scipy.interpolate import CubicSpline


def curve(corners, step_m=0.1):
    """Return (m, 2) points, about `step_m` [m] apart, of a smooth line through (k, 2) corners."""
    corners = np.asarray(corners, dtype=np.float64)
    chords = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(chords)])
    spline = CubicSpline(length, corners)
    return spline(np.linspace(0.0, length[-1], round(length[-1] / step_m) + 1))


class Floor:
    """A rectangle seen from above, and the circles of it that are taken."""

    def __init__(self, low, high, route, clear_m):
        """Take what is nearer than `clear_m` [m] to the (m, 2) route.

        Args:
            low: (2,) least x and y where something may stand [m].
            high: (2,) greatest x and y [m].
            route: (m, 2) points of the line that stays free.
            clear_m: free distance to either side of it [m].
        """
        self.low, self.high = np.asarray(low), np.asarray(high)
        self.taken = [(x, y, clear_m) for x, y in route]

    def take(self, rng, radius, tries=30):
        """Return the x, y of a free circle, from now on taken, or None where none was found."""
        taken = np.array(self.taken)
        for x, y in rng.uniform(self.low + radius, self.high - radius, (tries, 2)):
            apart = np.hypot(taken[:, 0] - x, taken[:, 1] - y)
            if (apart > taken[:, 2] + radius).all():
                self.taken.append((x, y, radius))
                return float(x), float(y)
        return None
