"""Points moved each by the motion at its own time, from a table of motions at equal steps."""

import numpy as np

from idem_ros.core.arrays import Floats, Points, Transforms
from idem_ros.core.jit import kernel


def moved_in_time(
    points: Points, times: Floats, motions: Transforms, begin: float, end: float
) -> Points:
    """Return points (N, 3), each moved by the motion of its time.

    Args:
        points: (N, 3).
        times: (N,).
        motions: (S, 4, 4), S >= 2, at times from `begin` to `end` in equal steps; between two the
            entries are linear, which is off by a 2 eighths where a is the angle between them.
        begin, end: of the table.
    """
    moved = np.empty_like(points)
    step = (end - begin) / (len(motions) - 1)
    _move(points, times, np.ascontiguousarray(motions[:, :3]), begin, step, moved)
    return moved


@kernel
def _move(
    points: Points, times: Floats, motions: Floats, begin: float, step: float, moved: Points
) -> None:
    last = motions.shape[0] - 2
    for i in range(points.shape[0]):
        at = (times[i] - begin) / step
        k = min(max(int(at), 0), last)
        after = at - k
        before = 1.0 - after
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for row in range(3):
            a = before * motions[k, row, 0] + after * motions[k + 1, row, 0]
            b = before * motions[k, row, 1] + after * motions[k + 1, row, 1]
            c = before * motions[k, row, 2] + after * motions[k + 1, row, 2]
            t = before * motions[k, row, 3] + after * motions[k + 1, row, 3]
            moved[i, row] = a * x + b * y + c * z + t
